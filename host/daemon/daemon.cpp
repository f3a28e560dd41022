#include "host/daemon/daemon.hpp"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <utility>

#include "host/config/rig_config.hpp"
#include "host/daemon/queued_sink.hpp"
#include "host/rig/rig_service.hpp"
#include "host/rig/service_manager.hpp"
#include "host/rpc/rpc_session.hpp"
#include "host/rpc/server.hpp"
#include "host/web/console.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

/// JOURNAL_STREAM holds device and inode of the stream, and a pipe put between has others.
bool journal_reads_standard_error() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat facts {};
  return stream != nullptr && ::fstat(STDERR_FILENO, &facts) == 0 &&
         fmt::format("{}:{}", facts.st_dev, facts.st_ino) == stream;
}

class JournalPriority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const char* priority = message.level >= spdlog::level::err    ? "<3>"
                           : message.level == spdlog::level::warn ? "<4>"
                           : message.level == spdlog::level::info ? "<6>"
                                                                  : "<7>";
    out.append(priority, priority + 3);
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<JournalPriority>();
  }
};

/// The daemon's log on standard error: with date and level for a person or a file, with the level as journald
/// reads it (sd-daemon(3): "<4>text") when standard error is a stream of the journal.
void set_up_daemon_log() {
  const auto log = std::make_shared<spdlog::logger>("diastole", std::make_shared<QueuedSink>(STDERR_FILENO));
  if (journal_reads_standard_error()) {
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<JournalPriority>('*').set_pattern("%*%v");
    log->set_formatter(std::move(formatter));
  }
  spdlog::set_default_logger(log);
}

RigConfig configured(const DaemonOptions& options) {
  RigConfig rig = read_rig(options.config);
  if (options.port) rig.controller.port = *options.port;
  if (options.socket) rig.daemon.socket = *options.socket;
  if (options.console) rig.daemon.console = *options.console;
  if (options.journal_dir) rig.daemon.journal_dir = *options.journal_dir;
  return rig;
}

/// SIGINT and SIGTERM: what moves is stopped, and the daemon ends when it is at rest and written. Every further
/// signal asks for the stop again.
class Ending {
 public:
  Ending(boost::asio::io_context& context, RigService& rig, boost::asio::signal_set& signals,
         ServiceManager& manager)
      : context_(context), rig_(rig), signals_(signals), manager_(manager), timer_(context) {
    await_signal();
  }

 private:
  void await_signal() {
    signals_.async_wait([this](const boost::system::error_code& error, int number) {
      if (error) return;
      spdlog::info("signal {}: stopping", number);
      manager_.stopping();
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
  ServiceManager& manager_;
  boost::asio::steady_timer timer_;
  bool begun_ = false;
};

/// If one is wanted; `by_option`: on the command line.
std::optional<web::ConsoleServer> open_console(const RigConfig& config, bool by_option,
                                               const std::shared_ptr<RpcState>& rpc_state) {
  if (!config.daemon.console) return std::nullopt;
  const web::ConsoleAddress address =
      by_option ? web::parse_console_address(*config.daemon.console, "--console", "")
                : web::parse_console_address(*config.daemon.console, config.file, "daemon.console");
  return std::optional<web::ConsoleServer>(
      std::in_place, rpc_state, address,
      std::filesystem::absolute(config.daemon.journal_dir) / "console-certificate.pem");
}

/// Says again and again that the server's thread is alive.
class ServerPulse {
 public:
  ServerPulse(boost::asio::io_context& context, ServiceManager& manager)
      : manager_(manager), timer_(context) {
    beat();
  }

 private:
  void beat() {
    manager_.server_lives();
    timer_.expires_after(manager_.server_interval());
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) beat();
    });
  }

  ServiceManager& manager_;
  boost::asio::steady_timer timer_;
};

}  // namespace

void run_daemon(const DaemonOptions& options) {
  set_up_daemon_log();
  std::signal(SIGPIPE, SIG_IGN);
  boost::asio::io_context context;
  boost::asio::signal_set signals(context, SIGINT, SIGTERM);
  const RigConfig config = configured(options);
  const ControlPolicy policy(config.daemon.control_group, config.file);
  ServiceManager manager;
  RigService rig(config, {options.conductor, options.daq_address, options.producer, &manager});
  Ending ending(context, rig, signals, manager);
  const ServerPulse pulse(context, manager);
  const auto rpc_state = std::make_shared<RpcState>(RpcState{context, rig, policy});
  if (config.daemon.socket == default_socket()) make_default_socket_folder();
  const RpcServer server(rpc_state, config.daemon.socket);
  const auto console = open_console(config, options.console.has_value(), rpc_state);
  nlohmann::json ready{{"ready", true}, {"socket", config.daemon.socket}};
  if (console) ready["console"] = rpc_state->console;
  std::cout << json_text(ready) << std::endl;
  manager.ready();
  context.run();
}

}  // namespace diastole
