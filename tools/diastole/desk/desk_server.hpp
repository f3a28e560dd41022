#pragma once
// The desk's door: HTTP on this machine's loopback, for one person's browser.
//
//   GET /, /desk.js, ...     the page; anybody on this machine may have it, it holds nothing
//   with the token ("Authorization: Bearer TOKEN"):
//   GET /tracking            {"html", "record"}: what was tracked; 503 before there is anything
//   GET /state               DeskSession::state(), and "edits"
//   POST /edits              one choice; answers as /state does; 422 with a sentence if it does not fit
//   POST /track              tracks again; answers as /state does
//
// Host and Origin are checked first, as at the console (host/web/door.hpp).

#include <cstdint>
#include <memory>
#include <string>

#include "tools/diastole/desk/desk_session.hpp"

namespace diastole::desk {

class DeskServer {
 public:
  /// Listens at 127.0.0.1; port 0: any free one. Throws HardwareError if it cannot.
  DeskServer(DeskSession& session, uint16_t port);
  ~DeskServer();

  [[nodiscard]] std::string url() const;  ///< with the token
  /// Serves until Ctrl-C or SIGTERM.
  void run();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace diastole::desk
