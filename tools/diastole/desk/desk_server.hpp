#pragma once
// The desk's endpoint: HTTP on this machine's loopback, for one person's browser.
//
//   GET /, /common.js, ...   the page; anybody on this machine may have it, it holds nothing
//   with the token ("Authorization: Bearer TOKEN"): what the desk's pages answer (DeskPages); 422 with a sentence for what does not fit
//
// Host and Origin are checked first, as at the console (host/web/access_policy.hpp).

#include <cstdint>
#include <memory>
#include <string>

#include "tools/diastole/desk/desk_pages.hpp"

namespace diastole::desk {

class DeskServer {
 public:
  /// Listens at 127.0.0.1; port 0: any free one. Throws HardwareError if it cannot.
  DeskServer(DeskPages& pages, uint16_t port);
  ~DeskServer();

  [[nodiscard]] std::string url() const;  ///< with the token
  /// Serves until Ctrl-C or SIGTERM.
  void run();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace diastole::desk
