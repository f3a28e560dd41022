#pragma once
// What is reported of gaps to the person in front: of one by itself at once that it began and what it cost; of many in a row
// one line a second, so that they drown nothing else. The journal's gap records know nothing of this.

#include <cstdint>
#include <functional>
#include <map>
#include <string>

namespace diastole {

class GapRemarks {
 public:
  static constexpr uint64_t interval_ns = 1'000'000'000;

  using Report = std::function<void(const std::string& code, const std::string& text)>;
  explicit GapRemarks(Report report) : report_(std::move(report)) {}

  /// `count` more samples in a row are missing; times never decrease.
  void missing(uint64_t now_ns, uint64_t count, const std::string& reason);
  /// A sample has come, or none will come any more.
  void received(uint64_t now_ns);
  /// Reports what is due; to be called now and then.
  void update(uint64_t now_ns);
  /// Reports what is left.
  void close(uint64_t now_ns);

 private:
  void report_many(uint64_t now_ns);

  Report report_;
  bool open_ = false;      // samples are missing
  bool reported_ = false;  // the gap that is open: its end is reported by itself
  const char* more_ = "";  // what of it was reported already
  uint64_t count_ = 0;     // in the gap that is open
  uint64_t since_ns_ = 0;  // of the many that are not reported yet
  uint64_t quiet_until_ns_ = 0;
  uint64_t gaps_ = 0;                        // not reported yet
  uint64_t samples_ = 0;                     // in them
  std::map<std::string, uint64_t> reasons_;  // samples for each
};

}  // namespace diastole
