#include "host/rpc/peer.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr size_t most_groups = 1024;

std::string user_name(uid_t uid) {
  passwd entry{};
  passwd* found = nullptr;
  std::array<char, 4096> memory{};
  if (::getpwuid_r(uid, &entry, memory.data(), memory.size(), &found) == 0 && found != nullptr) {
    return found->pw_name;
  }
  return fmt::to_string(uid);
}

std::vector<gid_t> supplementary_groups(int socket) {
  std::vector<gid_t> groups(most_groups);
  auto size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) != 0) size = 0;
  groups.resize(size / sizeof(gid_t));
  return groups;
}

}  // namespace

Peer peer_of(int socket) {
  ucred credentials{};
  socklen_t size = sizeof(credentials);
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0)
    return {static_cast<uid_t>(-1), 0, {}, "unknown"};
  Peer peer{credentials.uid, credentials.pid, supplementary_groups(socket), user_name(credentials.uid)};
  peer.groups.push_back(credentials.gid);
  return peer;
}

std::string in_words(const Peer& peer) {
  if (peer.console.empty()) return fmt::format("{} (process {})", peer.user, peer.pid);
  return fmt::format("{} (console at {})", peer.user.empty() ? "somebody" : peer.user, peer.console);
}

nlohmann::json as_json(const Peer& peer) {
  if (peer.console.empty()) return {{"user", peer.user}, {"uid", peer.uid}, {"pid", peer.pid}};
  return {{"user", peer.user}, {"console", peer.console}};
}

ControlPolicy::ControlPolicy(const std::string& group, const std::string& file) : own_(::geteuid()) {
  if (group.empty()) return;
  ::group entry{};
  ::group* found = nullptr;
  std::array<char, 16384> memory{};
  if (::getgrnam_r(group.c_str(), &entry, memory.data(), memory.size(), &found) != 0 || found == nullptr) {
    throw InputError({file, "daemon.control_group", fmt::format("there is no group \"{}\"", group),
                      "Make it (addgroup), or leave the key out: then root and the daemon's user control."});
  }
  group_ = entry.gr_gid;
}

bool ControlPolicy::may_control(const Peer& peer) const {
  if (!peer.console.empty()) return peer.role == ConsoleRole::control;
  if (peer.uid == 0 || peer.uid == own_) return true;
  return group_ && std::find(peer.groups.begin(), peer.groups.end(), *group_) != peer.groups.end();
}

}  // namespace diastole
