#include "host/journal/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <boost/crc.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <optional>

#include "host/journal/part_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr std::array<uint8_t, 4> magic{'D', 'J', 'R', '1'};
constexpr size_t header_bytes = 16;
constexpr size_t crc_bytes = 4;
constexpr uint32_t most_payload_bytes = 16U << 20;
constexpr std::chrono::milliseconds sync_interval{500};
constexpr size_t scan_bytes = 1U << 20;

uint32_t crc32c(std::span<const uint8_t> bytes) {
  boost::crc_optimal<32, 0x1EDC6F41, 0xFFFFFFFF, 0xFFFFFFFF, true, true> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

void put_u32(std::vector<uint8_t>& out, uint32_t value) {
  for (unsigned shift = 0; shift < 32; shift += 8)
    out.push_back(static_cast<uint8_t>(value >> shift));
}

uint32_t get_u32(std::span<const uint8_t> bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 4; i-- > 0;)
    value = value << 8U | bytes[at + i];
  return value;
}

/// Finds whole records in bytes that come piece by piece.
class RecordFinder {
 public:
  /// Returns how many of the bytes are done with; the others, with more behind them, belong into the next call.
  /// `all`: there are none behind these.
  size_t take(std::span<const uint8_t> bytes, bool all, const JournalRecords::Take& found) {
    size_t at = 0;
    while (at < bytes.size()) {
      const auto rest = bytes.subspan(at);
      const auto length = payload_bytes(rest);
      if (!all &&
          (rest.size() < header_bytes || (length && rest.size() < header_bytes + *length + crc_bytes))) {
        break;
      }
      if (length && is_whole(rest, *length) && get_u32(rest, 8) >= expected_) {
        hand_over(rest, *length, found);
        at += header_bytes + *length + crc_bytes;
      } else {
        ++at;
        ++damage_.torn_tail_bytes;
      }
    }
    return at;
  }
  [[nodiscard]] const JournalDamage& damage() const { return damage_; }
  [[nodiscard]] bool found_any() const { return found_any_; }

 private:
  /// None if no record begins here.
  static std::optional<size_t> payload_bytes(std::span<const uint8_t> bytes) {
    if (bytes.size() < header_bytes || !std::equal(magic.begin(), magic.end(), bytes.begin()))
      return std::nullopt;
    const size_t length = get_u32(bytes, 4);
    return length <= most_payload_bytes ? std::optional(length) : std::nullopt;
  }
  static bool is_whole(std::span<const uint8_t> bytes, size_t length) {
    return bytes.size() >= header_bytes + length + crc_bytes &&
           crc32c(bytes.first(header_bytes + length)) == get_u32(bytes, header_bytes + length);
  }
  void hand_over(std::span<const uint8_t> bytes, size_t length, const JournalRecords::Take& found) {
    found_any_ = true;
    damage_.damaged_bytes += std::exchange(damage_.torn_tail_bytes, 0);
    record_.sequence = get_u32(bytes, 8);
    damage_.records_lost += record_.sequence - expected_;
    expected_ = record_.sequence + 1;
    record_.kind = static_cast<RecordKind>(get_u32(bytes, 12));
    const auto payload = bytes.subspan(header_bytes, length);
    record_.payload.assign(payload.begin(), payload.end());
    found(record_);
  }

  JournalRecord record_;
  JournalDamage damage_;
  uint32_t expected_ = 0;
  bool found_any_ = false;
};

[[noreturn]] void refuse(const std::string& file, std::string problem, std::string remedy) {
  throw InputError({file, "", std::move(problem), std::move(remedy)});
}

JournalDamage scan(const std::filesystem::path& path, const JournalRecords::Take& found) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.valid() || std::filesystem::is_directory(path))
    refuse(path.string(), "cannot be opened", "Check the path and that you may read the file.");
  RecordFinder finder;
  std::vector<uint8_t> window;
  for (bool all = false; !all;) {
    const size_t held = window.size();
    window.resize(held + scan_bytes);
    const ssize_t got = ::read(file.get(), window.data() + held, scan_bytes);
    if (got < 0 && errno != EINTR)
      refuse(path.string(), fmt::format("cannot be read: {}", std::strerror(errno)), "Check the disk.");
    window.resize(held + static_cast<size_t>(std::max<ssize_t>(got, 0)));
    all = got == 0;
    const size_t done = finder.take(window, all, found);
    window.erase(window.begin(), window.begin() + static_cast<std::ptrdiff_t>(done));
  }
  if (!finder.found_any())
    refuse(path.string(), "holds no whole record of a journal",
           "Give a journal of the daemon (NAME.journal in its journal_dir).");
  return finder.damage();
}

void sync_directory(const std::filesystem::path& file) {
  const auto parent = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  const Descriptor directory(::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.valid()) ::fsync(directory.get());
}

}  // namespace

JournalWriter::JournalWriter(const std::filesystem::path& path, Flush flush, Write write)
    : path_(path),
      flush_(std::move(flush)),
      write_(std::move(write)),
      file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644)) {
  if (!file_.valid()) {
    throw HardwareError(path.string(), fmt::format("the journal cannot be created: {}", std::strerror(errno)),
                        "Check journal_dir in the rig file, its permissions and the space on its disk.");
  }
  sync_directory(path);
  syncer_ = std::jthread([this](const std::stop_token& stop) { sync_in_time(stop); });
}

JournalWriter::~JournalWriter() {
  syncer_.request_stop();
  syncer_.join();
  (void)sync();
}

bool JournalWriter::append(RecordKind kind, std::span<const uint8_t> payload) {
  if (!problem().empty()) return false;
  record_.assign(magic.begin(), magic.end());
  put_u32(record_, static_cast<uint32_t>(payload.size()));
  put_u32(record_, sequence_);
  put_u32(record_, static_cast<uint32_t>(kind));
  record_.insert(record_.end(), payload.begin(), payload.end());
  put_u32(record_, crc32c(record_));
  ssize_t written = -1;
  do {
    written = write_(file_.get(), record_.data(), record_.size());
  } while (written < 0 && errno == EINTR);
  if (written != static_cast<ssize_t>(record_.size())) {
    fail("written", written < 0 ? errno : ENOSPC);
    return false;
  }
  ++sequence_;
  unsynced_ = true;
  return true;
}

bool JournalWriter::append(RecordKind kind, const std::string& text) {
  return append(kind, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

bool JournalWriter::sync() {
  const std::lock_guard flushing(flush_mutex_);
  if (unsynced_.exchange(false) && flush_(file_.get()) != 0) fail("brought to the disk", errno);
  watch_name();
  return problem().empty();
}

std::string JournalWriter::problem() const {
  const std::lock_guard lock(problem_mutex_);
  return problem_;
}

void JournalWriter::fail(const std::string& what, int error) {
  keep(fmt::format("{}: the journal cannot be {}: {}", path_.string(), what, std::strerror(error)));
}

void JournalWriter::keep(std::string problem) {
  const std::lock_guard lock(problem_mutex_);
  if (problem_.empty()) problem_ = std::move(problem);
}

/// By the count of names and by the name alone: not every file system keeps the numbers of its files.
void JournalWriter::watch_name() {
  struct stat opened = {};
  struct stat named = {};
  if (!problem().empty() || ::fstat(file_.get(), &opened) != 0) return;
  const bool found = ::stat(path_.c_str(), &named) == 0 || errno != ENOENT;
  if (found && opened.st_nlink > 0) return;
  const std::string what = fmt::format("{}: the journal was ", path_.string());
  if (opened.st_nlink > 0) return keep(what + "moved away; what was recorded is where it was moved to");
  if (found) return keep(what + "replaced by another file; what was recorded is lost");
  try {
    copy_durably(fmt::format("/proc/self/fd/{}", file_.get()), path_);
    keep(what + "removed; what was recorded until then was put back");
  } catch (const std::filesystem::filesystem_error& error) {
    keep(what +
         fmt::format("removed and what was recorded is lost, for it cannot be put back: {}", error.what()));
  }
}

void JournalWriter::sync_in_time(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    wake_.wait_for(lock, stop, sync_interval, [] { return false; });
    (void)sync();
  }
}

JournalRecords::JournalRecords(const JournalContents& contents)
    : file_(contents.file), contents_(&contents) {}

JournalDamage JournalRecords::each(const Take& take) const {
  if (contents_ == nullptr) return scan(path_, take);
  for (const JournalRecord& record : contents_->records)
    take(record);
  return *contents_;
}

JournalContents read_journal(std::span<const uint8_t> bytes) {
  JournalContents contents;
  RecordFinder finder;
  (void)finder.take(bytes, true, [&](const JournalRecord& record) { contents.records.push_back(record); });
  static_cast<JournalDamage&>(contents) = finder.damage();
  return contents;
}

JournalContents read_journal(const std::filesystem::path& path) {
  JournalContents contents;
  static_cast<JournalDamage&>(contents) =
      scan(path, [&](const JournalRecord& record) { contents.records.push_back(record); });
  contents.file = path.string();
  return contents;
}

std::optional<JournalRecord> first_record(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<uint8_t> bytes(header_bytes);
  const auto read = [&](size_t from) {
    const auto count = static_cast<std::streamsize>(bytes.size() - from);
    return static_cast<bool>(file.read(reinterpret_cast<char*>(bytes.data() + from), count));
  };
  if (!read(0) || get_u32(bytes, 4) > most_payload_bytes) return std::nullopt;
  bytes.resize(header_bytes + get_u32(bytes, 4) + crc_bytes);
  if (!read(header_bytes)) return std::nullopt;
  JournalContents contents = read_journal(std::span<const uint8_t>(bytes));
  if (contents.records.empty()) return std::nullopt;
  return std::move(contents.records.front());
}

}  // namespace diastole
