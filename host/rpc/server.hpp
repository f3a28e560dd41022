#pragma once
// The daemon's socket: JSON-RPC 2.0, one JSON object a line (json_rpc.hpp).
//
//   method          params                          who           result
//   rig.status                                      anybody       Rig::status, and who controls the rig
//   run.progress    {first_remark}                  anybody       Rig::run
//   run.stop        {how: "cycle_end"|"now"|"halt"} anybody       {stopping}
//   run.start       {experiment, file, points, prompts_answered, resume}
//                                                   controller    {run_id, journal, run_file}
//   rig.home                                        controller    status
//   rig.zero        {channels, seconds, operator}   controller    Rig::calibrate; no channels: all
//   rig.calibrate   {channels: [one], kPa, seconds, operator}
//                                                   controller    the same
//   rig.clear_fault                                 controller    status
//   rig.jog         {mL, rate_mL_s}                 controller    status, and jogged_mL
//   rig.self_test   {seconds}                       controller    {passed, checks}: Rig::self_test
//   rig.settings                                    anybody       Rig::settings
//   rig.write_settings {set: {name: value}, defaults} controller  Rig::settings
//   rig.black_box                                   anybody       Rig::black_box
//   run.trace       {run_id, first_row, first_trigger}
//                                                   anybody       {run_id, first_row, time_s, kPa, filtered_kPa,
//                                                                  first_trigger, trigger_s}: columns, as
//                                                                  LiveTrace::since; null: a sample is missing
//   control.take    {take_over: who holds it}       controller    {user, uid, pid, own}, or {user, console, own}
//   control.release                                 anybody       {}
//   console.sign_in {name}                          consoles      {user, console}
//   console.address                                 who may control, at the socket
//                                                                 {control, watch}: addresses with tokens, and the
//                                                                 fingerprint of an encrypted console; or null
//
// The web console speaks the same in text messages of a WebSocket (host/web/console.hpp); these rules hold for both.
//
// Who may control: root, the user that runs the daemon, and the members of [daemon] control_group
// (SO_PEERCRED, SO_PEERGROUPS); all others observe and may stop. The first connection that gives an order
// holds the control until it releases it or closes, or until another takes it over by naming the holder
// (control_lease.hpp); a takeover is an event of the log and of the run.
//
// `points` holds the text of each points file that the experiment names: {name: text}. With `prompts_answered` the
// operator is waited for nowhere. With `resume` the last session of this experiment goes on with the first slice that was not
// imaged whole (host/rig/session_so_far.hpp).
//
// No client costs the rig anything (server.cpp): a line is bounded, and so are the answers that a client
// leaves unread, its requests a second and the time for a line; beyond most_connections the one that has said
// nothing for longest gives way.

#include <memory>
#include <string>

namespace diastole {

struct RpcState;

class RpcServer {
 public:
  static constexpr size_t most_connections = 128;

  /// Listens at `socket`; a socket left behind by a dead daemon is replaced. Throws HardwareError if another
  /// daemon listens there, the path cannot be used, or every user may write in its directory.
  RpcServer(std::shared_ptr<RpcState> rpc_state, const std::string& socket);
  ~RpcServer();

 private:
  class Listener;
  std::shared_ptr<Listener> listener_;
};

}  // namespace diastole
