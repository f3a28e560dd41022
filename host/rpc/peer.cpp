#include "host/rpc/peer.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
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

/// What the path goes through, links among it, belongs to root or `uid`, and nobody else may put anything in it.
bool only_writable_by(uid_t uid, std::filesystem::path path) {
  while (path != path.root_path()) {
    path = path.parent_path();
    struct stat facts {};
    if (::lstat(path.c_str(), &facts) != 0) return false;
    if (facts.st_uid != 0 && facts.st_uid != uid) return false;
    if (!S_ISLNK(facts.st_mode) && (facts.st_mode & (S_IWGRP | S_IWOTH)) != 0) return false;
  }
  return true;
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

bool may_serve(uid_t uid, const std::filesystem::path& socket) {
  if (uid == 0 || uid == ::geteuid()) return true;
  std::error_code lost;
  const std::filesystem::path named = std::filesystem::absolute(socket, lost).lexically_normal();
  const std::filesystem::path real = std::filesystem::canonical(named, lost);
  return !lost && only_writable_by(uid, named) && only_writable_by(uid, real);
}

void expect_daemon(int socket, const std::string& path) {
  const Peer daemon = peer_of(socket);
  if (may_serve(daemon.uid, path)) return;
  throw HardwareError(
      path,
      fmt::format("whoever listens at this socket runs as {}, and not only root and {} can put a "
                  "socket there: it need not be the rig's daemon",
                  daemon.user, daemon.user),
      "Name the daemon's own socket with --socket or --config; it lies in a directory that only "
      "the daemon's user writes in, as /run/diastole is.");
}

void expect_own_place(const std::string& path) {
  const std::string folder = std::filesystem::absolute(path).parent_path().string();
  struct stat facts {};
  if (::stat(folder.c_str(), &facts) != 0 || (facts.st_mode & S_IWOTH) == 0) return;
  throw HardwareError(
      path, fmt::format("every user may write in {}, and could stand there in the daemon's place", folder),
      "Choose a `socket` in a directory of the daemon's own ([daemon] in the rig file, or --socket).");
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
