#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/flash/updater.hpp"
#include "host/transport/serial_port.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/signing/signing_key.hpp"

namespace diastole {
namespace {

volatile std::sig_atomic_t interrupted = 0;

struct FlashOptions {
  std::string image;
  std::string port;
  unsigned baud = 460'800;
  UpdateOptions update;
  std::string new_key;
  std::string sign;
  std::optional<uint32_t> counter;
};

/// A bar that renews itself on a terminal, a line each quarter otherwise. On standard error.
class ProgressBar {
 public:
  void show(uint32_t held, uint32_t total) {
    constexpr uint32_t width = 40;
    const uint32_t percent = total == 0 ? 100 : static_cast<uint32_t>(uint64_t{held} * 100 / total);
    if (terminal_) {
      const std::string done(percent * width / 100, '#');
      fmt::print(stderr, "\r[{:<{}}] {:>3} %  {} of {} bytes", done, width, percent, held, total);
      if (held == total) fmt::print(stderr, "\n");
      std::fflush(stderr);
    } else if (percent / 25 > quarter_) {
      quarter_ = percent / 25;
      fmt::print(stderr, "{} of {} bytes\n", held, total);
    }
  }
  void say(const std::string& words) const { fmt::print(stderr, "{}\n", words); }

 private:
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  uint32_t quarter_ = 0;
};

std::string summary(const UpdateResult& result, const UpdateFile& file) {
  switch (result.end) {
    case UpdateEnd::confirmed:
      return fmt::format("version {} runs and is confirmed", in_words(file.version));
    case UpdateEnd::already_there:
      return fmt::format("nothing to do: the controller runs this very build of {} (--force sends it again)",
                         in_words(file.version));
    case UpdateEnd::dry_run:
      return fmt::format("would install version {}; nothing was changed", in_words(file.version));
    case UpdateEnd::stopped:
      return fmt::format(
          "stopped at {} of {} bytes, which stay there; the controller keeps its firmware. The same "
          "command goes on from here.",
          result.held_bytes, result.image_bytes);
  }
  return {};
}

const char* name_of(UpdateEnd end) {
  constexpr std::array names{"confirmed", "already_there", "dry_run", "stopped"};
  return names[static_cast<size_t>(end)];
}

ExitCode flash(FlashOptions options, const CommandOutput& out) {
  const auto began = std::chrono::steady_clock::now();
  const UpdateFile file = read_update_file(options.image);
  SerialPort line(options.port, options.baud);
  RealClock clock;
  ProgressBar bar;
  interrupted = 0;
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  options.update.stop_asked = [] { return interrupted != 0; };
  options.update.progress = [&bar](uint32_t held, uint32_t total) { bar.show(held, total); };
  options.update.say = [&bar](const std::string& words) { bar.say(words); };
  const UpdateResult result = flash_controller(clock, line, options.port, file, options.update);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  print(out,
        {{"image", file.file},
         {"version", in_words(file.version)},
         {"build", fmt::format("{:016x}", file.build_id)},
         {"result", name_of(result.end)},
         {"bytes", result.image_bytes},
         {"sent_bytes", result.sent_bytes},
         {"verified", result.verified},
         {"seconds", wall_s},
         {"version_before", result.before ? nlohmann::json(in_words(*result.before)) : nlohmann::json()}},
        [&] { fmt::print("{} ({:.1f} s)\n", summary(result, file), wall_s); });
  return result.end == UpdateEnd::stopped ? ExitCode::negative : ExitCode::done;
}

ExitCode make_key(const FlashOptions& options, const CommandOutput& out) {
  try {
    (void)signing::make_key_file(options.new_key);
  } catch (const std::runtime_error& problem) {
    throw InputError({"", "--new-key", problem.what(), ""});
  }
  print(out, {{"result", "key_made"}, {"key", options.new_key}}, [&] {
    fmt::print(
        "made {}: whoever has it can make firmware for your controllers, and without it they are flashed by "
        "SWD only. Keep a copy in a safe place, and build with -DDIASTOLE_SIGNING_KEY={}\n",
        options.new_key, std::filesystem::absolute(options.new_key).string());
  });
  return ExitCode::done;
}

ExitCode sign_image(const FlashOptions& options, const CommandOutput& out) {
  const UpdateFile file = sign_update_file(options.image, options.sign, options.counter);
  const uint32_t counter = file.images.front().signature.counter;
  print(out,
        {{"result", "signed"},
         {"image", file.file},
         {"version", in_words(file.version)},
         {"build", fmt::format("{:016x}", file.build_id)},
         {"counter", counter}},
        [&] { fmt::print("{} is signed, rollback counter {}\n", file.file, counter); });
  return ExitCode::done;
}

}  // namespace

void add_flash(CommandLine& line) {
  auto options = std::make_shared<FlashOptions>();
  CLI::App* command = line.add(
      "flash", "program the controller over its serial line, verify, start and confirm it",
      "  diastole flash build/firmware/bin/diastole-stm32f405.image --port /dev/ttyUSB0\n"
      "      sends the image to the slot that is free, has the controller verify it, starts it on\n"
      "      trial and confirms it; whatever goes wrong, the controller keeps what it ran\n"
      "  diastole flash diastole-stm32f405.image --port /dev/ttyUSB0 --dry-run\n"
      "      compares versions and changes nothing\n"
      "  diastole flash --new-key our-laboratory.pem\n"
      "      makes the key that firmware is signed with (-DDIASTOLE_SIGNING_KEY=FILE of the firmware's "
      "build)\n"
      "  diastole flash --sign our-laboratory.pem diastole-stm32f405.image --counter 3\n"
      "      signs an update file; a controller that has confirmed it takes none below 3 any more\n"
      "Stop the daemon first: it has the port. Interrupted (Ctrl-C, cable, power), the same command goes\n"
      "on where it stopped. A controller that does not answer is caught in its bootloader while you reset\n"
      "it. Exit code 1: stopped by Ctrl-C; 2: the file is not for this controller; 3: it does not answer,\n"
      "or came back with its former firmware.");
  auto* image = command->add_option("IMAGE", options->image, "update file (.image)");
  auto* port = command->add_option("--port", options->port, "the controller's serial port");
  command->add_option("--baud", options->baud, "its rate")->capture_default_str();
  command->add_flag("--allow-older", options->update.allow_older,
                    "also an older version than the one that runs");
  command->add_flag("--force", options->update.force, "also what it already runs, or an older version");
  auto* dry_run = command->add_flag("--dry-run", options->update.dry_run, "say what would be done");
  auto* sign = command->add_option("--sign", options->sign, "sign IMAGE in place with this key file");
  command->add_option("--counter", options->counter, "its rollback counter")->needs(sign);
  sign->needs(image)->excludes(port)->excludes(dry_run);
  command->add_option("--new-key", options->new_key, "make a key file")
      ->excludes(sign)
      ->excludes(dry_run)
      ->excludes(port)
      ->excludes(image);
  line.on_run(command, [options](const CommandOutput& out) {
    if (!options->new_key.empty()) return make_key(*options, out);
    if (!options->sign.empty()) return sign_image(*options, out);
    if (options->image.empty() || options->port.empty()) {
      throw InputError({"", options->image.empty() ? "IMAGE" : "--port", "is missing",
                        "Say which image goes to which port: diastole flash IMAGE --port /dev/ttyUSB0."});
    }
    options->update.allow_older = options->update.allow_older || options->update.force;
    return flash(*options, out);
  });
}

}  // namespace diastole
