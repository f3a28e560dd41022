#include "host/acquisition/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <array>
#include <boost/crc.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr std::array<uint8_t, 4> magic{'D', 'J', 'R', '1'};
constexpr size_t header_bytes = 16;
constexpr size_t crc_bytes = 4;
constexpr uint32_t most_payload_bytes = 16U << 20;
constexpr std::chrono::milliseconds sync_interval{500};

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

/// The whole record at `at`, or none.
std::optional<JournalRecord> record_at(std::span<const uint8_t> bytes, size_t at) {
  if (bytes.size() - at < header_bytes + crc_bytes) return std::nullopt;
  if (!std::equal(magic.begin(), magic.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at))) {
    return std::nullopt;
  }
  const uint32_t length = get_u32(bytes, at + 4);
  if (length > most_payload_bytes || bytes.size() - at - header_bytes - crc_bytes < length)
    return std::nullopt;
  if (crc32c(bytes.subspan(at, header_bytes + length)) != get_u32(bytes, at + header_bytes + length)) {
    return std::nullopt;
  }
  const auto payload = bytes.subspan(at + header_bytes, length);
  return JournalRecord{static_cast<RecordKind>(get_u32(bytes, at + 12)),
                       get_u32(bytes, at + 8),
                       {payload.begin(), payload.end()}};
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
  return problem().empty();
}

std::string JournalWriter::problem() const {
  const std::lock_guard lock(problem_mutex_);
  return problem_;
}

void JournalWriter::fail(const std::string& what, int error) {
  const std::lock_guard lock(problem_mutex_);
  if (!problem_.empty()) return;
  problem_ = fmt::format("{}: the journal cannot be {}: {}", path_.string(), what, std::strerror(error));
}

void JournalWriter::sync_in_time(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    wake_.wait_for(lock, stop, sync_interval, [] { return false; });
    (void)sync();
  }
}

JournalContents parse_journal(std::span<const uint8_t> bytes) {
  JournalContents contents;
  uint32_t expected = 0;
  size_t skipped = 0;
  for (size_t at = 0; at < bytes.size();) {
    auto record = record_at(bytes, at);
    if (!record || record->sequence < expected) {
      ++at;
      ++skipped;
      continue;
    }
    at += header_bytes + record->payload.size() + crc_bytes;
    contents.damaged_bytes += std::exchange(skipped, 0);
    contents.records_lost += record->sequence - expected;
    expected = record->sequence + 1;
    contents.records.push_back(std::move(*record));
  }
  contents.torn_tail_bytes = skipped;
  return contents;
}

JournalContents read_journal(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || std::filesystem::is_directory(path)) {
    throw InputError(
        {path.string(), "", "cannot be opened", "Check the path and that you may read the file."});
  }
  const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  JournalContents contents = parse_journal({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
  contents.file = path.string();
  if (contents.records.empty()) {
    throw InputError({path.string(), "", "holds no whole record of a journal",
                      "Give a journal of the daemon (NAME.journal in its journal_dir)."});
  }
  return contents;
}

}  // namespace diastole
