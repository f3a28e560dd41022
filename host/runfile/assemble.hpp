#pragma once
// A run from its journal: at the end of every run, and for `diastole recover` after a crash, by the same way.
//
// The time axis is the controller's clock, in seconds since the tick of RunStarted. Samples carry host times,
// which the fitted clock map (host/controller/clock_map.hpp) brings onto it. What was sampled before the start of run
// is cut off. A missing sample keeps its row: its time lies evenly between its neighbours', or is the one at
// which it was due if there is no sample before or none after it; its values are NaN, and /gaps declares it.
// Samples whose record was damaged are declared so, too; so is what a journal that broke off does not hold although the
// run went on (rows_due.hpp): "not recorded".

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "host/journal/journal.hpp"
#include "host/runfile/row_stream.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/run.hpp"
#include "protocol/runfile/session.hpp"
#include "protocol/signal/low_pass.hpp"

namespace diastole {

struct AssembledRun {
  runfile::RecordedRun run;
  runfile::Session session;
  JournalDamage damage;
  uint64_t samples_received = 0;  ///< rows of /pressure with values
  uint64_t samples_missing = 0;   ///< rows declared in /gaps
  bool ended_in_order = false;    ///< the journal holds the end of the run
};

/// The journal broke off before the run started, or before the first comparison of the clocks, some 250 ms after that:
/// there is nothing to keep.
class NothingRecorded : public InputError {
  using InputError::InputError;
};

/// A run whose rows stay in its journal until they are written, however many they are.
struct StreamedRun {
  AssembledRun assembled;  ///< run.pump and run.pressure are empty
  RowStream pump;
  RowStream pressure;
};

/// Throws NothingRecorded; InputError when the journal has lost its beginning or breaks a rule of runfile::check. The
/// journal's file must stay as it is until the streams were read.
StreamedRun stream_run(const JournalRecords& journal);

// The low-passed cavity pressure, /pressure/cavity_filtered_kPa, beside the raw one: cavity_kPa at 30 Hz forward and
// backward (protocol/signal/zero_phase.hpp), each stretch between missing samples by itself.

/// None when samples come slower than 75 Hz, too slow for that cutoff, or when there are fewer than two (spacing 0).
std::optional<signal::LowPassDesign> filter_of(double spacing_s);

/// What the dataset states of it: `filter`, `cutoff_Hz`, `order` of a pass, `passes`, `rate_Hz` that it was designed for,
/// and `delay_s`, which is 0.
std::map<std::string, runfile::Attribute, std::less<>> notes_of(const signal::LowPassDesign& design);

}  // namespace diastole
