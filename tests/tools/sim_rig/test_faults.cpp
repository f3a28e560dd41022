// Every fault of the list, switched on by its name, leaves its trace, and is gone when it is switched off. What host
// and controller make of it is tried in tests/flow.

#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "protocol/contract/input_error.hpp"
#include "tests/tools/sim_rig/scripted_controller.hpp"
#include "tools/sim_rig/faults.hpp"

namespace diastole::sim_rig {
namespace {

constexpr uint64_t ms = 1'000'000;
constexpr uint64_t inflating_ns = 400 * ms;  ///< 20 mL have gone in half-way
constexpr uint64_t settled_ns = 3'000 * ms;

/// The built-in rig, without noise, which homes and then inflates 20 mL in half a second.
class Bench {
 public:
  Bench() : Bench(std::make_unique<ScriptedController>(home_and_inflate(2567, 200'000))) {}

  Bench& set(std::string_view name, bool on) {
    const FaultKind& kind = fault_named(name);
    FaultTarget all{rig, instrument, cables};
    kind.set(all, on ? std::optional(kind.usual) : std::nullopt);
    return *this;
  }
  Bench& advance(uint64_t until_ns) {
    rig.advance_to(until_ns);
    return *this;
  }
  [[nodiscard]] double cavity_kPa() const { return rig.plant().cavity_kPa(); }
  [[nodiscard]] double read_kPa() const { return rig.plant().cavity_reading_kPa(); }

 private:
  explicit Bench(std::unique_ptr<ScriptedController> scripted)
      : controller(*scripted),
        rig(description(), std::move(scripted),
            {[](std::span<const uint8_t>) {}, [](const sim_controller::PinEdge&) {}}) {}

  static RigDescription description() {
    return read_rig_description(
        TableReader::from_text(default_rig_toml() + "\n[simulation]\ncavity_noise_kPa = 0.0\ndaq_bits = 0\n",
                               "the built-in rig file"));
  }

 public:
  ScriptedController& controller;
  Rig rig;
  sim_daq::ModbusInstrument instrument{{}, {[] { return uint64_t{0}; }, [](int) { return 0.0; }}};
  Cables cables{""};
};

/// Cavity pressure at a time, with a fault from the beginning.
double with_fault_kPa(std::string_view name, uint64_t time_ns) {
  return Bench().set(name, true).advance(time_ns).cavity_kPa();
}
double whole_kPa(uint64_t time_ns) { return Bench().advance(time_ns).cavity_kPa(); }

void expect_held(std::string_view name, sim_controller::Switch which) {
  Bench bench;
  EXPECT_TRUE(bench.set(name, true).controller.held.contains(which));
  EXPECT_FALSE(bench.set(name, false).controller.held.contains(which));
}

void expect_flag(std::string_view name, const std::function<bool(Bench&)>& trouble) {
  Bench bench;
  EXPECT_FALSE(trouble(bench));
  EXPECT_TRUE(trouble(bench.set(name, true)));
  EXPECT_FALSE(trouble(bench.set(name, false)));
}

const std::map<std::string_view, std::function<void()>>& traces() {
  static const std::map<std::string_view, std::function<void()>> all{
      {"estop", [] { expect_held("estop", sim_controller::Switch::estop); }},
      {"far-limit", [] { expect_held("far-limit", sim_controller::Switch::far_limit); }},
      {"home-limit", [] { expect_held("home-limit", sim_controller::Switch::home); }},
      {"power-cut", [] { expect_flag("power-cut", [](Bench& b) { return !b.controller.powered; }); }},
      {"serial-hangup",
       [] { expect_flag("serial-hangup", [](Bench& b) { return !b.cables.line.plugged_in(); }); }},
      {"serial-silence",
       [] {
         expect_flag("serial-silence", [](Bench& b) { return !b.cables.to_host && !b.cables.from_host; });
       }},
      {"serial-deaf",
       [] { expect_flag("serial-deaf", [](Bench& b) { return !b.cables.from_host && b.cables.to_host; }); }},
      {"gate-lost", [] { expect_flag("gate-lost", [](Bench& b) { return !b.cables.to_scanner; }); }},
      {"daq-stall",
       [] { expect_flag("daq-stall", [](Bench& b) { return b.instrument.faults().stall.holds(5); }); }},
      {"daq-drop",
       [] { expect_flag("daq-drop", [](Bench& b) { return b.instrument.faults().drop.holds(5); }); }},
      {"daq-delay",
       [] {
         expect_flag("daq-delay", [](Bench& b) {
           return b.instrument.faults().delay.holds(5) && b.instrument.faults().delay_ns == 50 * ms;
         });
       }},
      {"daq-error", [] { expect_flag("daq-error", [](Bench& b) { return b.instrument.faults().refuse; }); }},
      {"daq-short",
       [] { expect_flag("daq-short", [](Bench& b) { return b.instrument.faults().cut_short; }); }},
      {"daq-stuck", [] { expect_flag("daq-stuck", [](Bench& b) { return b.instrument.faults().stuck; }); }},
      {"daq-clock-jump",
       [] {
         expect_flag("daq-clock-jump", [](Bench& b) { return b.instrument.faults().timer_ahead_s == 0.5; });
       }},
      {"sensor-offset",
       [] {
         Bench bench;
         bench.advance(settled_ns);
         const double before_kPa = bench.read_kPa();
         EXPECT_NEAR(bench.set("sensor-offset", true).read_kPa(), before_kPa + 0.5, 1e-9);
         EXPECT_NEAR(bench.set("sensor-offset", false).read_kPa(), before_kPa, 1e-9);
       }},
      {"sensor-drift",
       [] {
         Bench bench;
         bench.set("sensor-drift", true).advance(settled_ns);
         EXPECT_NEAR(bench.read_kPa() - bench.cavity_kPa(), 0.05 * 3, 0.02);
         EXPECT_NEAR(bench.set("sensor-drift", false).read_kPa(), bench.cavity_kPa(), 0.02);
       }},
      {"leak",
       [] {
         const double end_kPa = with_fault_kPa("leak", settled_ns);
         EXPECT_LT(end_kPa, 0.7 * whole_kPa(settled_ns));
         EXPECT_LT(with_fault_kPa("leak", settled_ns + 1000 * ms), 0.95 * end_kPa) << "it goes on leaking";
         Bench stopped;
         const double left_kPa = stopped.set("leak", true)
                                     .advance(settled_ns)
                                     .set("leak", false)
                                     .advance(settled_ns + 20 * ms)
                                     .cavity_kPa();
         EXPECT_NEAR(stopped.advance(settled_ns + 1000 * ms).cavity_kPa(), left_kPa, 0.02 * left_kPa);
       }},
      {"air-bubble",
       [] {
         const double end_kPa = with_fault_kPa("air-bubble", settled_ns);
         EXPECT_LT(end_kPa, 0.95 * whole_kPa(settled_ns));
         EXPECT_GT(end_kPa, 0.5 * whole_kPa(settled_ns));
         EXPECT_NEAR(with_fault_kPa("air-bubble", settled_ns + 1000 * ms), end_kPa, 0.02 * end_kPa)
             << "it takes its share once";
       }},
      {"blocked-hose",
       [] {
         Bench whole, kinked;
         const double open_kPa = whole.advance(inflating_ns).rig.plant().pump_end_kPa();
         EXPECT_GT(kinked.set("blocked-hose", true).advance(inflating_ns).rig.plant().pump_end_kPa(),
                   open_kPa + 4);
         EXPECT_NEAR(with_fault_kPa("blocked-hose", settled_ns), whole_kPa(settled_ns), 0.05)
             << "what went in arrives in the end";
       }},
      {"step-loss",
       [] {
         EXPECT_NEAR(with_fault_kPa("step-loss", settled_ns), 0, 1e-6);
         Bench half;
         half.rig.carriage().slip().lose(0.5);
         half.advance(settled_ns);
         EXPECT_LT(half.cavity_kPa(), 0.7 * whole_kPa(settled_ns));
       }},
      {"slipping-coupling",
       [] {
         Bench bench;
         bench.rig.carriage().slip().slip_above(2.0);  // the usual 15 kPa is for cycles of 1.2 s
         bench.advance(settled_ns);
         EXPECT_LT(bench.cavity_kPa(), 2.1);
         EXPECT_GT(bench.cavity_kPa(), 1.0);
         EXPECT_LT(bench.cavity_kPa(), 0.9 * whole_kPa(settled_ns));
       }},
  };
  return all;
}

TEST(RigFaults, EveryFaultOfTheListLeavesItsTrace) {
  for (const FaultKind& kind : fault_kinds()) {
    SCOPED_TRACE(kind.name);
    const auto trace = traces().find(kind.name);
    ASSERT_NE(trace, traces().end()) << "no test tells what it looks like";
    trace->second();
  }
  EXPECT_EQ(traces().size(), fault_kinds().size());
}

TEST(RigFaults, EveryFaultIsTold) {
  std::string listed = "\n";
  listed += list_of_faults();
  for (const FaultKind& kind : fault_kinds()) {
    std::string line = "\n";
    line.append(kind.name).append(" ");
    EXPECT_NE(listed.find(line), std::string::npos) << kind.name;
    EXPECT_GE(kind.usual, kind.least) << kind.name;
    EXPECT_LE(kind.usual, kind.most) << kind.name;
  }
}

TEST(RigFaults, AMistypedNameIsToldTheNearest) {
  try {
    fault_named("serial-hangupp");
    FAIL() << "an unknown fault was taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("Did you mean \"serial-hangup\"?"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace diastole::sim_rig
