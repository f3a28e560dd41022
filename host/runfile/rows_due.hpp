#pragma once
// How many rows each stream must have, by the clocks and not by what came.
//
// A run that was closed in order states until when samples were due; the controller's end states until when there were
// positions. A journal that breaks off knows the last moment that it reports: a position, a trigger, an event,
// a pair of clocks, a sample. The run went on until then at least, so what is not there up to then was not recorded.

#include <cstdint>
#include <optional>

#include "host/journal/parsed_journal.hpp"
#include "host/runfile/time_axis.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole {

/// Seconds since the start of run; no longer than any run of these segments goes on.
double last_known_s(const ParsedJournal& parsed, const TimeAxis& axis);

/// Rows of a grid that are due at or before `time_s`; at most `most_rows`.
uint64_t rows_due_by(double time_s, double start_s, double spacing_s);

/// Samples that were due until the recording's end, counted from sample 0; none: the journal does not state them.
std::optional<uint64_t> samples_due(const ParsedJournal& parsed);

/// The positions that the controller took. None: not known, because there is no position, or because the line was lost
/// (a closed journal without the controller's end).
std::optional<runfile::StreamGrid> position_grid(const ParsedJournal& parsed, const TimeAxis& axis);

}  // namespace diastole
