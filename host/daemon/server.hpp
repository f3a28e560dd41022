#pragma once
// The daemon's socket: JSON-RPC 2.0, one JSON object a line (json_rpc.hpp).
//
//   method          params                          who           result
//   rig.status                                      anybody       RigService::status
//   run.progress    {first_remark}                  anybody       RigService::run_progress
//   run.stop        {how: "cycle_end" | "now"}      anybody       {stopping}
//   run.start       {experiment, file}              controller    {run_id, journal, run_file}
//   rig.home                                        controller    status
//   rig.clear_fault                                 controller    status
//   control.release                                 anybody       {}
//
// Who may control: the user that runs the daemon, and root (SO_PEERCRED); all others observe and may stop.
// The first connection that gives an order holds the control until it releases it or closes. A line longer
// than rpc::most_line_bytes, or a reader that leaves that much unread, ends its connection.

#include <boost/asio/io_context.hpp>
#include <memory>
#include <string>

#include "host/daemon/rig_service.hpp"

namespace diastole {

class RpcServer {
 public:
  /// Listens at `socket`; a socket left behind by a dead daemon is replaced. Throws HardwareError if another
  /// daemon listens there or the path cannot be used.
  RpcServer(boost::asio::io_context& context, RigService& rig, const std::string& socket);
  ~RpcServer();

 private:
  class Listener;
  std::shared_ptr<Listener> listener_;
};

}  // namespace diastole
