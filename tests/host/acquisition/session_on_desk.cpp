#include "tests/host/acquisition/session_on_desk.hpp"

namespace diastole {

const char* const short_session = R"(
format = "diastole-experiment"
version = 1
sample_rate_Hz = 300
rest_s = 0.1
[[segment]]
waveform = "parabolic"
stroke_mL = 10.0
period_s = 0.8
cycles = 2
)";

SessionOnDesk::SessionOnDesk(const std::string& experiment_text)
    : experiment(parse_experiment(experiment_text, "desk.experiment.toml")) {}

void SessionOnDesk::run(const std::function<StopRequest()>& stop) {
  client.connect();
  client.home();
  while (client.status().state == wire::State::homing)
    desk.advance_to(desk.now_ns + 20'000'000);
  const ProgramPlan plan = client.load(experiment);
  JournalWriter writer(journal, flush, write);
  const nlohmann::json beginning{{"record", "begin"},
                                 {"run_id", "11111111-2222-3333-4444-555555555555"},
                                 {"started_utc", "2026-01-02T03:04:05Z"},
                                 {"producer", "test"},
                                 {"experiment", experiment.text},
                                 {"experiment_file", experiment.file},
                                 {"sample_rate_Hz", experiment.sample_rate_Hz},
                                 {"channels", {"cavity"}},
                                 {"rig", {{"bore_mm", 100.0}, {"microsteps", 8}, {"specimen", "gel"}}},
                                 {"instrument", instrument.describe()},
                                 {"tick_rate_Hz", client.hello().tick_rate_Hz},
                                 {"microstep_pL", client.microstep_pL()},
                                 {"daq_timer_rate_Hz", instrument.timer_rate_Hz()},
                                 {"segments",
                                  {{{"start_s", 1e-6 * static_cast<double>(plan.at(0).start_us)},
                                    {"waveform", experiment.segments[0].waveform_name},
                                    {"stroke_mL", experiment.segments[0].stroke_mL},
                                    {"period_s", experiment.segments[0].period_s},
                                    {"offset_mL", experiment.segments[0].offset_mL},
                                    {"cycles", experiment.segments[0].cycles}}}}};
  (void)writer.append(RecordKind::document, beginning.dump());
  std::vector<PlannedSlice> slices;
  if (experiment.schedule) slices = planned_slices(*experiment.schedule);
  if (live != nullptr) live->begin("desk", experiment.sample_rate_Hz, client.hello().tick_rate_Hz);
  const auto samples = make_source(clock, instrument);
  outcome = acquire(
      clock, client, *samples, writer,
      {experiment.sample_rate_Hz, rig.daq.channels, {}, gate, experiment.least_duration_s(), slices, live},
      {.stop = stop,
       .go_on = go_on,
       .progress = [](const RunProgress&) {},
       .remark = [this](const RunRemark& remark) { remarks.push_back(remark); }});
}

}  // namespace diastole
