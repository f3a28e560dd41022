#pragma once
// Who is at the other end of a unix socket, as the kernel vouches for it (SO_PEERCRED, SO_PEERGROUPS).

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace diastole {

struct Peer {
  uid_t uid = static_cast<uid_t>(-1);  ///< -1: unknown
  pid_t pid = 0;
  std::vector<gid_t> groups;  ///< primary and supplementary
  std::string user;           ///< name, or the number if it has none
};

/// Of a connected socket. Never throws: what cannot be found out stays unknown, and may do nothing.
Peer peer_of(int socket);

/// "anna (process 1234)".
std::string in_words(const Peer& peer);

/// Who may give orders: root, the user that runs the daemon, and the members of one group, if it is named;
/// all others observe and may stop.
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
