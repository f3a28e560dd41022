#pragma once
// A whole session on the desk: firmware, client, acquisition, journal, run.

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "host/acquisition/acquisition.hpp"
#include "host/controller/controller_client.hpp"
#include "tests/host/bench/desk.hpp"
#include "tests/host/bench/run_in_memory.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {

struct SessionOnDesk {
  Scratch scratch{"session"};
  Desk desk;
  DeskClock clock{desk};
  DeskInstrument instrument{desk};
  RigConfig rig = example_rig();
  ControllerClient client{clock, rig, [this] { return std::make_unique<DeskLine>(desk); }};
  Experiment experiment;
  std::filesystem::path journal = scratch / "run.journal";
  JournalWriter::Flush flush = ::fdatasync;  ///< the journal's
  JournalWriter::Write write = ::write;      ///< likewise
  std::function<std::optional<size_t>()> go_on = [] { return std::optional<size_t>(); };
  GateInputs* gate = nullptr;
  LiveTrace* live = nullptr;  ///< of run "desk"
  std::vector<RunRemark> remarks;
  RunOutcome outcome;

  explicit SessionOnDesk(const std::string& experiment_text);
  /// Connects, homes, loads, runs; `stop` as in AcquisitionHooks.
  void run(const std::function<StopRequest()>& stop = [] { return StopRequest::none; });
  [[nodiscard]] AssembledRun assemble() const { return assemble_run(read_journal(journal)); }
};

/// Two parabolic cycles of 10 mL in 0.8 s after 0.1 s of rest, 300 Hz.
extern const char* const short_session;

}  // namespace diastole
