#include "host/rpc/control_lease.hpp"

#include <fmt/format.h>

#include "host/rpc/json_rpc.hpp"

namespace diastole {
namespace {

[[noreturn]] void refuse(const Peer& holder) {
  throw rpc::Error(
      rpc::Code::control_held,
      fmt::format("the rig is controlled by {0}; if that is agreed, take it over: --take-over {1}",
                  in_words(holder), holder.user),
      as_json(holder));
}

bool means(const std::string& named, const Peer& holder) {
  return named == holder.user || (holder.console.empty() && named == fmt::to_string(holder.pid));
}

}  // namespace

void ControlLease::claim(uint64_t connection, const Peer& peer) {
  if (holder_ && holder_->connection != connection) refuse(holder_->peer);
  holder_ = Holder{connection, peer};
}

std::optional<Peer> ControlLease::take_over(uint64_t connection, const Peer& peer, const std::string& named) {
  const std::optional<Holder> before = holder_;
  const bool from_another = before && before->connection != connection;
  if (from_another && !means(named, before->peer)) refuse(before->peer);
  holder_ = Holder{connection, peer};
  return from_another ? std::optional(before->peer) : std::nullopt;
}

void ControlLease::release(uint64_t connection) {
  if (holder_ && holder_->connection == connection) holder_.reset();
}

}  // namespace diastole
