#pragma once
// Who is let in at the web console: what a request's headers must say. Texts in, a verdict out; no input or output.
//
// Three things are guarded against. A page of another site that opens a socket to us: its Origin is not ours. A name
// that its owner makes point to this machine (DNS rebinding), so that his page is "ours": our Host is an address or
// this machine's own name. Anybody else on this machine or on the network: he has no token.

#include <boost/asio/ip/address.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "host/rpc/peer.hpp"

namespace diastole::web {

/// Where the console listens.
struct ConsoleAddress {
  boost::asio::ip::address address;
  uint16_t port = 0;  ///< 0: any free one
};

inline constexpr uint16_t usual_port = 8600;

/// "8600", "192.168.1.5:8600", "[::1]:8600", or empty for 127.0.0.1 and the usual port. Throws InputError that names
/// `file` and `place`.
ConsoleAddress parse_console_address(const std::string& text, const std::string& file,
                                     const std::string& place);

struct Refusal {
  int status = 400;      ///< of HTTP
  std::string sentence;  ///< for the person
};

class AccessPolicy {
 public:
  /// New tokens; `machine`: the machine's own name, as gethostname returns it. Beyond loopback it is taken as it is and
  /// up to its first dot, and no other: whoever owns a domain can make MACHINE.his.domain point here.
  AccessPolicy(const ConsoleAddress& address, std::string machine);

  /// `origin`: none when the header is absent, as with clients that are no browsers.
  [[nodiscard]] std::optional<Refusal> check_place(std::string_view host,
                                                   std::optional<std::string_view> origin) const;
  /// Whom the token lets in, if anybody.
  [[nodiscard]] std::optional<ConsoleRole> role_of(std::string_view token) const;
  [[nodiscard]] static Refusal wrong_token();

  /// "http://127.0.0.1:8600/#token=...", https beyond this machine; the browser keeps what follows # to itself. `port`: the one that was given.
  [[nodiscard]] std::string url(ConsoleRole role, uint16_t port) const;
  [[nodiscard]] bool reaches_beyond_this_machine() const { return !address_.address.is_loopback(); }

 private:
  [[nodiscard]] bool is_own(std::string_view name) const;

  ConsoleAddress address_;
  std::string machine_;
  std::string control_token_;
  std::string watch_token_;
};

/// The token of "Authorization: Bearer TOKEN", or of the sub-protocol "token.TOKEN" that a browser's WebSocket offers
/// (it can send no other header); empty if there is none.
std::string_view token_in(std::string_view authorization, std::string_view protocols);

/// 128 bits of the kernel's randomness, as 32 hexadecimal digits. Throws HardwareError if the kernel gives none.
std::string new_token();

/// Compares in a time that does not depend on where the two differ.
bool same_secret(std::string_view a, std::string_view b);

}  // namespace diastole::web
