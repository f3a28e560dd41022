#include "host/doctor/machine_checks.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <grp.h>
#include <pthread.h>
#include <pwd.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <thread>

#include "host/doctor/udev_rules.hpp"
#include "host/transport/descriptor.hpp"
#include "host/transport/real_time.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using State = MachineCheck::State;

constexpr const char* rules_file = "60-diastole.rules";
constexpr const char* own_group = device_group;

MachineCheck good(std::string name, std::string found) {
  return {std::move(name), State::good, std::move(found), ""};
}
MachineCheck lacking(std::string name, std::string found, std::string remedy) {
  return {std::move(name), State::lacking, std::move(found), std::move(remedy)};
}
MachineCheck not_used(std::string name, std::string found) {
  return {std::move(name), State::not_used, std::move(found), ""};
}

/// Devices of /dev whose names begin so.
std::vector<std::string> devices(const std::vector<std::string>& beginnings) {
  std::vector<std::string> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/dev", ignored)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::any_of(beginnings,
                            [&](const std::string& beginning) { return name.starts_with(beginning); }))
      found.push_back(entry.path().string());
  }
  std::ranges::sort(found);
  return found;
}

std::string user_name() {
  const passwd* user = ::getpwuid(::geteuid());
  return user == nullptr ? fmt::format("{}", ::geteuid()) : user->pw_name;
}

std::string remedy_for_access() {
  return fmt::format(
      "Give it to the group {}: diastole doctor --config rig.toml --udev-rules | sudo tee "
      "/etc/udev/rules.d/61-diastole-rig.rules; and run the daemon as the service, which is in that group, "
      "or "
      "sudo usermod -aG {} {} and log in anew.",
      own_group, own_group, user_name());
}

MachineCheck check_port(const std::optional<RigConfig>& rig) {
  constexpr const char* name = "serial port";
  constexpr const char* plug_in =
      "Plug the controller's board in; `sudo dmesg | tail` tells what the kernel found.";
  const std::vector<std::string> ports = devices({"ttyACM", "ttyUSB"});
  const std::string port = rig ? rig->controller.port : ports.empty() ? "" : ports.front();
  if (port.empty()) return lacking(name, "there is no /dev/ttyACM* and no /dev/ttyUSB*", plug_in);
  std::error_code ignored;
  if (!fs::exists(port, ignored))
    return lacking(name,
                   fmt::format("{} is not there; there {} {}", port, ports.size() == 1 ? "is" : "are",
                               ports.empty() ? "none" : fmt::format("{}", fmt::join(ports, ", "))),
                   ports.empty() ? plug_in
                                 : fmt::format("Plug it in, or name {} in the rig file's [controller] port.",
                                               ports.front()));
  if (::access(port.c_str(), R_OK | W_OK) != 0)
    return lacking(name, port + " may not be opened", remedy_for_access());
  return good(name, port);
}

MachineCheck check_groups() {
  constexpr const char* name = "groups";
  if (::geteuid() == 0) return good(name, "root may open every device");
  const group* own = ::getgrnam(own_group);
  if (own == nullptr)
    return lacking(name, fmt::format("there is no group {}", own_group),
                   fmt::format("sudo groupadd --system {}; or install the package.", own_group));
  std::array<gid_t, 256> groups{};
  const int count = ::getgroups(static_cast<int>(groups.size()), groups.data());
  const bool member = own->gr_gid == ::getegid() ||
                      std::find(groups.begin(), groups.begin() + std::max(count, 0), own->gr_gid) !=
                          groups.begin() + std::max(count, 0);
  return member ? good(name, fmt::format("{} belongs to {}", user_name(), own_group))
                : lacking(name, fmt::format("{} does not belong to {}", user_name(), own_group),
                          remedy_for_access());
}

MachineCheck check_rules() {
  constexpr const char* name = "udev rules";
  for (const char* folder : {"/etc/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"}) {
    std::error_code ignored;
    if (const fs::path file = fs::path(folder) / rules_file; fs::exists(file, ignored))
      return good(name, file.string());
  }
  return lacking(name, fmt::format("{} is not installed: devices belong to root alone", rules_file),
                 fmt::format("sudo cp packaging/{} /etc/udev/rules.d/ && sudo udevadm control --reload && "
                             "sudo udevadm trigger; or install the package.",
                             rules_file));
}

MachineCheck check_gpio(const std::optional<RigConfig>& rig) {
  constexpr const char* name = "GPIO";
  const std::vector<std::string> chips = devices({"gpiochip"});
  const std::string words =
      chips.empty() ? "this machine has no /dev/gpiochip*" : fmt::format("{}", fmt::join(chips, ", "));
  if (!rig || !rig->gpio) return not_used(name, words + "; the rig file has no [gpio]");
  const std::string chip = rig->gpio->chip.starts_with('/') ? rig->gpio->chip : "/dev/" + rig->gpio->chip;
  std::error_code ignored;
  if (!fs::exists(chip, ignored))
    return lacking(
        name, chip + " is not there; " + words,
        "Name another in [gpio] chip, or leave [gpio] out: the controller counts triggers itself.");
  if (::access(chip.c_str(), R_OK | W_OK) != 0)
    return lacking(name, chip + " may not be opened", remedy_for_access());
  return good(name, chip);
}

MachineCheck check_instrument(const std::optional<RigConfig>& rig) {
  constexpr const char* name = "instrument";
  if (!rig) return not_used(name, "no rig file was given: --config FILE");
  try {
    return good(name, rig->daq.open({})->describe());
  } catch (const HardwareError& error) {
    const std::string words = error.what();
    const size_t line_end = words.find("\n  ");
    return lacking(
        name, words.substr(0, line_end),
        line_end == std::string::npos ? "Switch it on and connect it." : words.substr(line_end + 3));
  }
}

MachineCheck check_time() {
  constexpr const char* name = "time";
  timex state{};
  const int result = ::adjtimex(&state);
  const bool synchronised = result >= 0 && result != TIME_ERROR && (state.status & STA_UNSYNC) == 0;
  return synchronised ? good(name, fmt::format("the clock is kept, to {:.1f} ms",
                                               1e-3 * static_cast<double>(state.maxerror)))
                      : lacking(name,
                                "nobody keeps the clock: runs would carry a wrong date (their time axis is "
                                "the controller's)",
                                "sudo apt install systemd-timesyncd && sudo timedatectl set-ntp true");
}

MachineCheck check_priority() {
  constexpr const char* name = "priority";
  rlimit limit{};
  (void)::getrlimit(RLIMIT_RTPRIO, &limit);
  if (::geteuid() == 0 || limit.rlim_cur >= static_cast<rlim_t>(instrument_priority))
    return good(name, fmt::format("real-time priority {} may be asked for", instrument_priority));
  return lacking(
      name,
      fmt::format("real-time priority ends at {}, the daemon wants {}", limit.rlim_cur, instrument_priority),
      fmt::format(
          "Run the daemon as the service (systemctl start diastole-daemon), or put `@{} - rtprio {}` into "
          "/etc/security/limits.d/diastole.conf and log in anew.",
          own_group, instrument_priority));
}

/// An hour at 300 Hz comes to some 60 MB of journal and run file; this is a day of sessions.
constexpr double least_room_MB = 500;
/// The journal's syncer works twice a second: what takes longer falls behind.
constexpr double longest_sync_s = 0.5;
constexpr int syncs_tried = 20;

/// The longest time in which the disk took a block; none if nothing can be written there.
std::optional<double> longest_sync(const fs::path& folder) {
  std::string name = (folder / "diastole-doctor-XXXXXX").string();
  const Descriptor file(::mkstemp(name.data()));
  if (!file.valid()) return std::nullopt;
  ::unlink(name.c_str());
  const std::array<char, 4096> block{};
  double longest_s = 0;
  for (int i = 0; i < syncs_tried; ++i) {
    const auto before = std::chrono::steady_clock::now();
    if (::write(file.get(), block.data(), block.size()) != static_cast<ssize_t>(block.size()) ||
        ::fdatasync(file.get()) != 0)
      return std::nullopt;
    longest_s =
        std::max(longest_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count());
  }
  return longest_s;
}

MachineCheck check_disk(const std::optional<RigConfig>& rig) {
  constexpr const char* name = "disk";
  fs::path folder = fs::absolute(rig ? rig->daemon.journal_dir : fs::path("."));
  while (!fs::exists(folder) && folder.has_relative_path())
    folder = folder.parent_path();
  struct statvfs room {};
  if (::statvfs(folder.c_str(), &room) != 0)
    return lacking(name, fmt::format("{}: {}", folder.string(), std::strerror(errno)),
                   "Name another [daemon] journal_dir.");
  const double free_MB = 1e-6 * static_cast<double>(room.f_bavail) * static_cast<double>(room.f_frsize);
  const auto sync_s = longest_sync(folder);
  if (!sync_s)
    return lacking(name, folder.string() + " cannot be written",
                   "Name another [daemon] journal_dir, or give the daemon's user the right to write there.");
  const std::string words = fmt::format("{}: {:.1f} GB free, a block reaches it in {:.0f} ms at most",
                                        folder.string(), 1e-3 * free_MB, 1e3 * *sync_s);
  if (free_MB < least_room_MB)
    return lacking(name, words, fmt::format("Make room: at least {:g} MB.", least_room_MB));
  if (*sync_s > longest_sync_s)
    return lacking(
        name, words,
        "Keep journals on a disk of this machine ([daemon] journal_dir), not on a share or a worn card.");
  return good(name, words);
}

}  // namespace

Latency measure_latency(double seconds, const std::function<bool()>& go_on) {
  constexpr int64_t period_ns = 1'000'000;
  Latency latency{.seconds = seconds};
  std::vector<double> late_us;
  std::thread([&] {
    ask_for_real_time(instrument_priority);
    int policy = SCHED_OTHER;
    sched_param parameter{};
    latency.priority =
        ::pthread_getschedparam(::pthread_self(), &policy, &parameter) == 0 && (policy & SCHED_FIFO) != 0;
    timespec due{};
    ::clock_gettime(CLOCK_MONOTONIC, &due);
    const auto wakes = static_cast<int64_t>(std::ceil(seconds * 1e9 / static_cast<double>(period_ns)));
    for (int64_t i = 0; i < wakes && go_on(); ++i) {
      due.tv_nsec += period_ns;
      if (due.tv_nsec >= 1'000'000'000) {
        due.tv_nsec -= 1'000'000'000;
        ++due.tv_sec;
      }
      while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
      }
      timespec now{};
      ::clock_gettime(CLOCK_MONOTONIC, &now);
      late_us.push_back(1e6 * static_cast<double>(now.tv_sec - due.tv_sec) +
                        1e-3 * static_cast<double>(now.tv_nsec - due.tv_nsec));
    }
  }).join();
  if (late_us.empty()) return latency;
  std::ranges::sort(late_us);
  const auto at = [&](double part) {
    return late_us[static_cast<size_t>(part * static_cast<double>(late_us.size() - 1))];
  };
  latency.wakes = static_cast<int64_t>(late_us.size());
  latency.median_us = at(0.5);
  latency.p999_us = at(0.999);
  latency.worst_us = late_us.back();
  return latency;
}

MachineCheck check_latency(const Latency& latency) {
  utsname kernel{};
  (void)::uname(&kernel);
  const std::string words = fmt::format(
      "{} wakes in {:g} s {} priority: {:.0f} us late in the middle, {:.0f} us one in a thousand, {:.0f} us "
      "at worst (Linux {})",
      latency.wakes, latency.seconds, latency.priority ? "with" : "without", latency.median_us,
      latency.p999_us, latency.worst_us, kernel.release);
  if (latency.worst_us <= latest_wake_us) return good("latency", words);
  return lacking(
      "latency", words,
      fmt::format(
          "A wake later than {:.0f} us costs a sample at 300 Hz, which is declared as a gap. {}",
          latest_wake_us,
          latency.priority
              ? "End other work, or install a real-time kernel: sudo apt install linux-image-rt-amd64."
              : "Give the daemon its priority first (see priority above)."));
}

std::vector<MachineCheck> check_machine(const std::optional<RigConfig>& rig) {
  return {check_port(rig),       check_groups(), check_rules(),    check_gpio(rig),
          check_instrument(rig), check_time(),   check_priority(), check_disk(rig)};
}

}  // namespace diastole
