#pragma once
// The rows of a run's streams wherever they are, in memory or in a file: who looks at them does so block by block and needs no more
// memory for an hour than for a second.

#include <map>
#include <optional>
#include <string>

#include "protocol/runfile/run.hpp"
#include "protocol/runfile/series.hpp"
#include "protocol/runfile/spacing.hpp"

namespace diastole::runfile {

/// The rows of /pressure or of /pump.
class StreamRows {
 public:
  Series time_s;
  std::map<std::string, Series, std::less<>> values;  ///< by dataset name, "cavity_kPa"

  /// Of the times, which it goes through once, when first asked.
  [[nodiscard]] const Spacing& spacing() const {
    if (!spacing_) spacing_ = spacing_of(time_s);
    return *spacing_;
  }

 private:
  mutable std::optional<Spacing> spacing_;
};

struct RunRows {
  StreamRows pump;
  StreamRows pressure;
};

/// Of a run in memory, which outlives them.
inline RunRows rows_of(const RecordedRun& run) {
  RunRows rows;
  rows.pump.time_s = run.pump.time_s;
  rows.pump.values["commanded_mL"] = run.pump.commanded_mL;
  rows.pressure.time_s = run.pressure.time_s;
  for (const auto& [name, values_kPa] : run.pressure.channels)
    rows.pressure.values[name] = values_kPa;
  return rows;
}

}  // namespace diastole::runfile
