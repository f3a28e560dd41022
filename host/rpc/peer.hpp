#pragma once
// Who is at the other end: of a unix socket, as the kernel vouches for it (SO_PEERCRED, SO_PEERGROUPS); of the web
// console, as the token says and as the operator calls himself.

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace diastole {

/// Whom a browser is let in as.
enum class ConsoleRole { control, watch };

struct Peer {
  uid_t uid = static_cast<uid_t>(-1);  ///< -1: unknown
  pid_t pid = 0;
  std::vector<gid_t> groups;  ///< primary and supplementary
  std::string user;           ///< name, or the number if it has none; at a console: what was typed, or empty
  std::string console = {};   ///< the browser's address; empty: at the unix socket
  ConsoleRole role = ConsoleRole::watch;  ///< at a console
};

/// Of a connected socket. Never throws: what cannot be found out stays unknown, and may do nothing.
Peer peer_of(int socket);

/// Whether a client may take whom it meets at `socket` for its daemon: `uid` is root or the client's own user, or nobody but
/// root and that user can put a socket there – it owns the socket's directory, and on the way to it there is no directory that
/// others may write in. So the system's service is known, and a path in a person's home; a stranger's socket in /tmp is not.
bool may_serve(uid_t uid, const std::filesystem::path& socket);

/// Of a client that has connected to `path`: throws HardwareError if whoever listens there may not serve it.
void expect_daemon(int socket, const std::string& path);

/// Of a daemon that is to listen at `path`: throws HardwareError if other users may write in its directory, and so could stand
/// there in the daemon's place.
void expect_own_place(const std::string& path);

/// "anna (process 1234)", "anna (console at 127.0.0.1)".
std::string in_words(const Peer& peer);

/// For clients: {"user", "uid", "pid"}, or {"user", "console"}.
nlohmann::json as_json(const Peer& peer);

/// Who may give orders: root, the user that runs the daemon, the members of one group, if it is named, and
/// whoever came to the console with the token for it; all others observe and may stop.
class ControlPolicy {
 public:
  /// `group` empty: none. Throws InputError naming `file` if there is no such group.
  ControlPolicy(const std::string& group, const std::string& file);
  [[nodiscard]] bool may_control(const Peer& peer) const;

 private:
  uid_t own_;
  std::optional<gid_t> group_;
};

}  // namespace diastole
