#pragma once
// The journal: what a run brought in, appended to one file as it comes, so that a crash loses at most the
// last second. The run file is made from it at the end (host/runfile/assemble.hpp), or by `diastole recover`.
//
// A journal is a chain of records, each written with one write(2):
//
//   offset  size  field
//        0     4  magic     "DJR1"
//        4     4  length    of the payload, little-endian
//        8     4  sequence  0, 1, 2, ...
//       12     4  kind      RecordKind
//       16     n  payload
//     16+n     4  crc       CRC-32C (Castagnoli) of bytes 0 ... 15+n
//
// Every half second another thread asks the kernel to bring it to the disk (fdatasync). Once the disk has
// refused a write or a flush, what is in the file can no longer be trusted to last: the problem stays, and
// nothing more is written. The same holds when the file is no longer found under its name; if it was removed, what it
// held is put back there first. A reader takes every
// record whose CRC holds. It forgives a torn tail, and after damage in the middle it searches for the next
// whole record; the sequence then shows how many are lost.

#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "host/transport/descriptor.hpp"
#include "host/transport/real_time.hpp"

namespace diastole {

/// What a payload holds; journal_records.hpp has the coding.
enum class RecordKind : uint32_t {
  document = 1,   ///< JSON text: beginning, events, triggers, clock pairs, end
  samples = 2,    ///< a block of samples
  positions = 3,  ///< a block of the controller's position stream
};

class JournalWriter {
 public:
  /// As fdatasync(2): 0, or -1 and errno.
  using Flush = std::function<int(int descriptor)>;
  /// As write(2): the number of bytes taken, or -1 and errno.
  using Write = std::function<ssize_t(int descriptor, const void* bytes, size_t size)>;

  /// Creates the file; it must not exist. Throws HardwareError if it cannot be created.
  explicit JournalWriter(const std::filesystem::path& path, Flush flush = ::fdatasync, Write write = ::write);
  ~JournalWriter();

  /// Appends one record. False if the disk did not take it whole (full, failed), or failed to flush what came
  /// before; `problem()` then says why, what was written before stays readable, and nothing more is written.
  [[nodiscard]] bool append(RecordKind kind, std::span<const uint8_t> payload);
  [[nodiscard]] bool append(RecordKind kind, const std::string& text);
  /// Returns when everything is on the disk; false if it is not, now or before (`problem()`).
  [[nodiscard]] bool sync();

  /// Empty: none so far. Of any thread.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  void sync_in_time(const std::stop_token& stop);
  /// Keeps the first problem.
  void fail(const std::string& what, int error);
  void keep(std::string problem);
  /// Sees that the file is still there under its name.
  void watch_name();

  std::filesystem::path path_;
  Flush flush_;
  Write write_;
  Descriptor file_;
  uint32_t sequence_ = 0;
  std::vector<uint8_t> record_;
  mutable InheritingMutex problem_mutex_;  // held for moments only
  std::string problem_;
  std::mutex flush_mutex_;  // held during a flush
  std::atomic<bool> unsynced_ = false;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread syncer_;  // last: it uses the members above
};

struct JournalRecord {
  RecordKind kind = RecordKind::document;
  uint32_t sequence = 0;
  std::vector<uint8_t> payload;
};

/// What lies between and behind the whole records.
struct JournalDamage {
  size_t damaged_bytes = 0;    ///< skipped between whole records
  size_t torn_tail_bytes = 0;  ///< behind the last whole record
  size_t records_lost = 0;     ///< by their sequence, before the last whole one
};

struct JournalContents : JournalDamage {
  std::string file;
  std::vector<JournalRecord> records;
};

/// Goes through a journal's file, or through what was read of one, as often as one likes. Of a file no more than one
/// record is held in memory at a time.
class JournalRecords {
 public:
  using Take = std::function<void(const JournalRecord&)>;

  explicit JournalRecords(std::filesystem::path path) : file_(path.string()), path_(std::move(path)) {}
  /// `contents` outlives this.
  explicit JournalRecords(const JournalContents& contents);

  /// Every whole record in order. Throws InputError if the file cannot be read or holds no whole record at all.
  JournalDamage each(const Take& take) const;
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  std::string file_;
  std::filesystem::path path_;
  const JournalContents* contents_ = nullptr;
};

/// All of it at once. Throws as JournalRecords::each.
JournalContents read_journal(const std::filesystem::path& path);
JournalContents read_journal(std::span<const uint8_t> bytes);

/// The first record of a journal, without reading on; none if the file does not begin with a whole one.
std::optional<JournalRecord> first_record(const std::filesystem::path& path);

}  // namespace diastole
