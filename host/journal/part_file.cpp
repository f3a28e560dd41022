#include "host/journal/part_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>

#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::minutes untouched{1};  // a process of another machine, on a shared disk, still writes

/// {"gel.run.h5", 4711} of "gel.run.h5.4711.part".
struct PartName {
  std::string of;
  pid_t process = 0;
};

std::optional<PartName> part_name(const std::string& name) {
  constexpr std::string_view ending = ".part";
  if (!name.ends_with(ending)) return std::nullopt;
  const std::string_view stem = std::string_view(name).substr(0, name.size() - ending.size());
  const size_t dot = stem.rfind('.');
  if (dot == std::string_view::npos) return std::nullopt;
  const auto process = parse_number<pid_t>(stem.substr(dot + 1));
  if (!process || *process <= 0) return std::nullopt;
  return PartName{std::string(stem.substr(0, dot)), *process};
}

bool is_gone(pid_t process) { return ::kill(process, 0) != 0 && errno == ESRCH; }

void must(bool done, const char* what, const fs::path& file) {
  if (!done) throw fs::filesystem_error(what, file, std::error_code(errno, std::generic_category()));
}

void copy_bytes(const fs::path& from, const fs::path& to) {
  const Descriptor source(::open(from.c_str(), O_RDONLY | O_CLOEXEC));
  must(source.valid(), "cannot be read", from);
  const Descriptor target(::open(to.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  must(target.valid(), "cannot be made", to);
  std::array<char, 1U << 16U> buffer;
  for (ssize_t held = 0; (held = ::read(source.get(), buffer.data(), buffer.size())) != 0;) {
    if (held < 0 && errno == EINTR) continue;
    must(held > 0, "cannot be read", from);
    for (ssize_t done = 0; done < held;) {
      const ssize_t written = ::write(target.get(), buffer.data() + done, static_cast<size_t>(held - done));
      if (written < 0 && errno == EINTR) continue;
      must(written > 0, "cannot be written", to);
      done += written;
    }
  }
  must(::fsync(target.get()) == 0, "cannot be brought to the disk", to);
}

fs::path parent_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : "."; }

}  // namespace

fs::path part_file_of(const fs::path& file) { return fmt::format("{}.{}.part", file.string(), ::getpid()); }

void remove_leftovers(const fs::path& file) {
  std::error_code ignored;
  const bool all = fs::is_directory(file, ignored);
  const auto now = fs::file_time_type::clock::now();
  for (const auto& entry : fs::directory_iterator(all ? file : parent_of(file), ignored)) {
    const auto part = part_name(entry.path().filename().string());
    if (!part || !entry.is_regular_file(ignored)) continue;
    if (all ? !part->of.ends_with(".run.h5") : part->of != file.filename().string()) continue;
    if (!is_gone(part->process) || entry.last_write_time(ignored) > now - untouched) continue;
    fs::remove(entry.path(), ignored);
  }
}

void write_whole(const fs::path& file, const std::function<void(const fs::path& part)>& write) {
  const fs::path part = part_file_of(file);
  try {
    write(part);
    fs::rename(part, file);
  } catch (...) {
    std::error_code ignored;
    fs::remove(part, ignored);
    throw;
  }
}

void copy_durably(const fs::path& from, const fs::path& to) {
  write_whole(to, [&](const fs::path& part) { copy_bytes(from, part); });
  const Descriptor directory(::open(parent_of(to).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  must(directory.valid() && ::fsync(directory.get()) == 0, "its name cannot be brought to the disk", to);
}

void write_text_file(const fs::path& file, std::string_view content) try {
  write_whole(file, [&](const fs::path& part) {
    std::ofstream stream(part, std::ios::binary);
    stream.write(content.data(), static_cast<std::streamsize>(content.size()));
    stream.close();
    must(static_cast<bool>(stream), "cannot be written", part);
  });
} catch (const fs::filesystem_error&) {
  throw HardwareError(file.string(), "cannot be written", "Check the disk's space and your rights there.");
}

}  // namespace diastole
