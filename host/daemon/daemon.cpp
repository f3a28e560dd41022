#include "host/daemon/daemon.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <iostream>
#include <utility>

#include "host/config/rig_config.hpp"
#include "host/daemon/rig_service.hpp"
#include "host/daemon/server.hpp"

namespace diastole {
namespace {

RigConfig configured(const DaemonOptions& options) {
  RigConfig rig = read_rig(options.config);
  if (options.port) rig.controller.port = *options.port;
  if (options.socket) rig.daemon.socket = *options.socket;
  if (options.journal_dir) rig.daemon.journal_dir = *options.journal_dir;
  return rig;
}

/// SIGINT and SIGTERM: what moves is stopped, and the daemon ends when it is at rest and written. Every further
/// signal asks for the stop again.
class Ending {
 public:
  Ending(boost::asio::io_context& context, RigService& rig, boost::asio::signal_set& signals)
      : context_(context), rig_(rig), signals_(signals), timer_(context) {
    await_signal();
  }

 private:
  void await_signal() {
    signals_.async_wait([this](const boost::system::error_code& error, int number) {
      if (error) return;
      spdlog::info("signal {}: stopping", number);
      const bool idle = rig_.idle();
      rig_.end();
      if (!std::exchange(begun_, true)) idle ? context_.stop() : await_rest();
      await_signal();
    });
  }

  void await_rest() {
    const bool idle = rig_.idle();
    // Whoever follows the run asks ten times a second, and shall still hear how it ended.
    timer_.expires_after(std::chrono::milliseconds(idle ? 500 : 20));
    timer_.async_wait([this, idle](const boost::system::error_code& error) {
      if (error) return;
      idle ? context_.stop() : await_rest();
    });
  }

  boost::asio::io_context& context_;
  RigService& rig_;
  boost::asio::signal_set& signals_;
  boost::asio::steady_timer timer_;
  bool begun_ = false;
};

}  // namespace

void run_daemon(const DaemonOptions& options) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("diastole"));
  std::signal(SIGPIPE, SIG_IGN);
  boost::asio::io_context context;
  boost::asio::signal_set signals(context, SIGINT, SIGTERM);
  const RigConfig config = configured(options);
  const ControlPolicy policy(config.daemon.control_group, config.file);
  RigService rig(config, {options.conductor, options.daq_address, options.producer});
  Ending ending(context, rig, signals);
  const RpcServer server(context, rig, config.daemon.socket, policy);
  std::cout << nlohmann::json{{"ready", true}, {"socket", config.daemon.socket}}.dump() << std::endl;
  context.run();
}

}  // namespace diastole
