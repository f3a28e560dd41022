#include "host/daemon/daemon.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <iostream>

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

}  // namespace

void run_daemon(const DaemonOptions& options) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("diastole"));
  std::signal(SIGPIPE, SIG_IGN);
  boost::asio::io_context context;
  boost::asio::signal_set signals(context, SIGINT, SIGTERM);
  signals.async_wait([&context](const boost::system::error_code& error, int number) {
    if (error) return;
    spdlog::info("signal {}: stopping", number);
    context.stop();
  });
  const RigConfig config = configured(options);
  RigService rig(config, {options.conductor, options.daq_address, options.producer});
  const RpcServer server(context, rig, config.daemon.socket);
  std::cout << nlohmann::json{{"ready", true}, {"socket", config.daemon.socket}}.dump() << std::endl;
  context.run();
}

}  // namespace diastole
