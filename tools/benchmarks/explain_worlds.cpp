#include "tools/benchmarks/explain_worlds.hpp"

#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <fstream>
#include <random>

#include "estimator/explain/rig/experiment_outlook.hpp"
#include "estimator/explain/rig/explain_rig.hpp"
#include "estimator/explain/verdict/experiment_plan.hpp"
#include "estimator/explain/verdict/explanation_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/model/session.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "tools/benchmarks/timed_process.hpp"
#include "tools/score/score.hpp"
#include "tools/sim_rig/hidden_effects.hpp"

namespace diastole::bench {
namespace {

namespace fs = std::filesystem;
using explain::EffectSize;
using explain::Explanation;
using explain::ScoredCase;
using explain::Truth;
using explain::Verdict;

const fs::path example = fs::path(DIASTOLE_SOURCE_DIR) / "examples/hidden-effect";

struct Asked {
  Truth truth;
  fs::path study;
};

/// Explains a study, or reads what a stopped run answered.
Explanation answer(const fs::path& study, const fs::path& file, bool resume) {
  if (resume && fs::exists(file)) return explain::explanation_from_json(read_whole_file(file), file.string());
  Explanation found = explain::explain_rig(read_study(study), {.threads = 2, .progress = {}});
  found.traces.clear();
  const fs::path part = file.string() + ".part";
  std::ofstream(part) << explain::to_json(found);
  fs::rename(part, file);
  return found;
}

std::vector<ScoredCase> answers(const std::vector<Asked>& sessions, const fs::path& kept, bool resume) {
  fs::create_directories(kept);
  std::vector<ScoredCase> cases;
  const bool terminal = isatty(STDERR_FILENO) != 0;
  for (const Asked& session : sessions) {
    if (terminal)
      fmt::print(stderr, "\r{}: {} of {} \x1b[K", kept.filename().string(), cases.size() + 1,
                 sessions.size());
    cases.push_back({session.truth, answer(session.study, kept / (session.truth.name + ".json"), resume)});
  }
  if (terminal) fmt::print(stderr, "\r\x1b[K");
  return cases;
}

/// The labelled sessions whose study NAME/NAME{ending} exists; none, and a line that says so, without labels.
std::vector<Asked> recorded(const fs::path& folder, const std::string& ending) {
  if (!fs::exists(folder / "labels.json")) {
    fmt::print("skipped: no labels.json in {}\n", folder.string());
    return {};
  }
  std::vector<Asked> sessions;
  for (Truth& truth : explain::read_truths(folder)) {
    const fs::path study = folder / truth.name / (truth.name + ending);
    if (fs::exists(study)) sessions.push_back({std::move(truth), study});
  }
  return sessions;
}

bool report(const std::string& title, const std::vector<ScoredCase>& cases, const explain::Targets& targets) {
  if (cases.empty()) return true;
  const explain::Score score = explain::score_cases(cases, targets);
  fmt::print("\n=== {} ({} sessions)\n{}", title, cases.size(), explain::in_words(score));
  std::fflush(stdout);
  return score.met();
}

/// Is the answer what is hidden, in full: also nothing, or of no library?
bool is_truth(const ScoredCase& c) {
  if (c.truth.kind == explain::TruthKind::none) return c.found.verdict == Verdict::none;
  if (c.truth.kind == explain::TruthKind::outside) return c.found.verdict == Verdict::unexplained;
  return explain::is_exact(c);
}

void report_proposals(const std::vector<ScoredCase>& again) {
  const auto hits = static_cast<size_t>(std::ranges::count_if(again, is_truth));
  const auto [low, high] = explain::clopper_pearson(hits, again.size());
  fmt::print("\nThe answer is the truth after the proposed experiment: {} of {} (95 %: {:.0f} to {:.0f} %)\n",
             hits, again.size(), 100.0 * low, 100.0 * high);
}

// --- World 3 -----------------------------------------------------------------------------------------------------------

constexpr std::array unknown_kPa{1.0, 20.0};

void put(std::string& text, const std::string& line, const std::string& by) {
  const size_t at = text.find(line);
  if (at == std::string::npos) throw std::runtime_error("the study has no line " + line);
  text.replace(at, line.size(), by);
}

std::string C1_lines(std::array<double, 2> C1_kPa) {
  return fmt::format("start = {:.4f}\nbounds = [{:.4f}, {:.4f}]", 0.5 * (C1_kPa[0] + C1_kPa[1]), C1_kPa[0],
                     C1_kPa[1]);
}

/// The example's study of a run NAME.run.h5, with bounds of the modulus and references.
std::string study_of(const std::string& name, std::array<double, 2> C1_kPa, const std::string& references) {
  std::string text = read_whole_file(example / "mine.study.toml");
  put(text, "start = 8.8\nbounds = [1.0, 20.0]", C1_lines(C1_kPa));
  put(text, "runs = [\"mine.run.h5\"]", fmt::format("runs = [\"{}.run.h5\"]\n{}", name, references));
  return text;
}

/// What a proposed experiment asks for besides strokes (estimator/explain/verdict/experiment_plan.hpp).
struct Instruments {
  bool pump_sensor = false, volumes = false, radius = false, shear_test = false;
};

Instruments asked_for(const std::string& experiment) {
  const auto asks = [&](std::string_view words) { return experiment.find(words) != std::string::npos; };
  return {.pump_sensor = asks(explain::ask_for_pump_sensor),
          .volumes = asks(explain::ask_for_volumes),
          .radius = asks(explain::ask_for_radius),
          .shear_test = asks(explain::ask_for_stiffness)};
}

std::string in_words(const Instruments& asked) {
  return fmt::format("{}{}{}", asked.pump_sensor ? " (pump sensor)" : "",
                     asked.volumes ? " (gated volumes)" : "", asked.shear_test ? " (shear test)" : "");
}

struct Simulated {
  uint64_t rig = 1;
  uint64_t seed = 1;  ///< of the noise
  std::vector<std::string> hidden;
  double C1_kPa = 8.8;
  uint64_t hide_seed = 1;
  Instruments instruments = {};
};

void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

constexpr const char* pump_channel =
    "\n[[daq.channel]]\nname = \"pump\"\ninput = 1\nkPa_per_V = 20.0\nzero_V = 0.0\n";
constexpr double phase_contrast_sd_mL = 0.6;  // as the proposals count on

/// NAME.run.h5 in `folder`, and what is hidden in it sealed/NAME.sealed.json.
void simulate(const Simulated& session, const fs::path& folder, const std::string& name,
              const fs::path& experiment = example / "mine.experiment.toml") {
  const fs::path run = folder / (name + ".run.h5");
  const fs::path rig = folder / (name + ".rig.toml");
  const std::string text = read_whole_file(fs::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml") +
                           fmt::format("\n[simulation]\nC1_kPa = {:.4f}\n", session.C1_kPa) +
                           (session.instruments.pump_sensor ? pump_channel : "");
  if (fs::exists(run) && fs::exists(rig) && read_whole_file(rig) == text) return;
  fs::remove(run);
  write(rig, text);
  std::vector<std::string> command{DIASTOLE_BIN_DIR "/diastole",
                                   "simulate",
                                   experiment.string(),
                                   "-o",
                                   name + ".run.h5",
                                   "--config",
                                   name + ".rig.toml",
                                   "--rig-seed",
                                   fmt::to_string(session.rig),
                                   "--seed",
                                   fmt::to_string(session.seed),
                                   "--hide-seed",
                                   fmt::to_string(session.hide_seed),
                                   "--sealed",
                                   "sealed/" + name + ".sealed.json"};
  for (const std::string& id : session.hidden)
    command.insert(command.end(), {"--hide", id});
  if (session.instruments.volumes)
    command.insert(command.end(), {"--gated-volume", fmt::to_string(phase_contrast_sd_mL)});
  const fs::path log = folder / (name + ".log");
  // 1: noted in the run file, as a transducer at the pump that stands at the end of its range.
  if (run_timed(command, folder, log).exit_code > (session.instruments.pump_sensor ? 1 : 0))
    throw std::runtime_error("diastole simulate failed: " + read_whole_file(log));
}

/// Mean square of what two sessions differ by in the cavity's pressure, kPa^2; modulus and offset may follow.
double difference_kPa2(const fs::path& one, const fs::path& other) {
  const auto trace = [](const fs::path& study) {
    const rig::Session session = rig::read_session(read_study(study));
    return session.runs.front().pressure_kPa.at(rig::Channel::cavity);
  };
  const std::vector<double> a = trace(one), b = trace(other);
  const auto count = static_cast<Eigen::Index>(std::min(a.size(), b.size()));
  const Eigen::Map<const Eigen::VectorXd> seen(a.data(), count), base(b.data(), count);
  Eigen::MatrixXd follows(count, 2);
  follows << base, Eigen::VectorXd::Ones(count);
  const Eigen::VectorXd change = seen - base;
  const Eigen::VectorXd left = change - follows * follows.householderQr().solve(change);
  return left.squaredNorm() / static_cast<double>(count);
}

/// One round: every effect once, three outside the library, six times nothing, eight pairs.
std::vector<std::vector<std::string>> hidden_in_round(uint64_t round) {
  std::mt19937_64 random(round);
  std::vector<std::vector<std::string>> sets(6, {"none"});
  std::vector<std::string> known;
  for (const sim_rig::HiddenKind& kind : sim_rig::hidden_kinds()) {
    sets.push_back({std::string(kind.id)});
    if (!kind.is_outside()) known.emplace_back(kind.id);
  }
  for (int pair = 0; pair < 8; ++pair) {
    const size_t first = random() % known.size(),
                 second = (first + 1 + random() % (known.size() - 1)) % known.size();
    sets.push_back({known[first], known[second]});
  }
  return sets;
}

/// The sessions of one rig, simulated.
struct Round {
  fs::path folder;
  std::vector<Simulated> sessions;
  std::vector<Asked> alone, with_reference;

  /// Of a pair the first effect alone, of the same size.
  [[nodiscard]] fs::path of_first(size_t k) const {
    return folder / (alone[k].truth.name + "-first.study.toml");
  }
};

Round simulated_round(uint64_t number, const fs::path& folder) {
  Round round{.folder = folder, .sessions = {}, .alone = {}, .with_reference = {}};
  std::mt19937_64 random(1000 + number);
  const auto casting_kPa = [&] { return 8.8 * (0.9 + 0.2 * static_cast<double>(random() >> 11) * 0x1p-53); };
  fs::create_directories(folder / "sealed");
  std::vector<std::pair<std::string, Simulated>> sessions;
  uint64_t seed = 1000 * number;
  std::string references;
  for (const char* name : {"ref-1", "ref-2"}) {
    ++seed;
    const Simulated session{number, seed, {"none"}, casting_kPa(), seed};
    sessions.emplace_back(name, session);
    write(folder / fmt::format("{}.study.toml", name),
          study_of(name, {0.98 * session.C1_kPa, 1.02 * session.C1_kPa}, ""));
    references += fmt::format("{}\"{}.study.toml\"", references.empty() ? "" : ", ", name);
  }
  const double C1_kPa = casting_kPa();
  std::vector<std::string> names;
  for (const std::vector<std::string>& hidden : hidden_in_round(number)) {
    const std::string& name = names.emplace_back(fmt::format("r{}-{:02}", number, names.size() + 1));
    ++seed;
    round.sessions.push_back({number, seed, hidden, C1_kPa, seed});
    sessions.emplace_back(name, round.sessions.back());
    if (hidden.size() == 2) {
      sessions.emplace_back(name + "-first", Simulated{number, seed + 500, {hidden.front()}, C1_kPa, seed});
      write(folder / (name + "-first.study.toml"), study_of(name + "-first", unknown_kPa, ""));
    }
    write(folder / (name + ".study.toml"), study_of(name, unknown_kPa, ""));
    write(folder / (name + "-with-reference.study.toml"),
          study_of(name, unknown_kPa, "reference = [" + references + "]\n"));
  }
  parallel_for(sessions.size(), 2,
               [&](size_t k) { simulate(sessions[k].second, folder, sessions[k].first); });
  for (const std::string& name : names) {
    const Truth truth = explain::read_truths(folder / "sealed" / (name + ".sealed.json")).front();
    round.alone.push_back({truth, folder / (name + ".study.toml")});
    round.with_reference.push_back({truth, folder / (name + "-with-reference.study.toml")});
  }
  return round;
}

/// Runs what answers propose that are open or have hints, on the same rig with the instruments that they ask for, and asks again
/// with both runs. An image at rest is not made: what it corrects is the study.
std::vector<ScoredCase> asked_again(const Round& round, const std::vector<Asked>& asked,
                                    const std::vector<ScoredCase>& cases, const fs::path& kept, bool resume) {
  std::vector<size_t> open;
  std::vector<Asked> again;
  std::vector<Instruments> instruments;
  const auto experiment_of = [&](const Truth& truth) {
    return round.folder / (truth.name + ".experiment.toml");
  };
  for (size_t k = 0; k < cases.size(); ++k) {
    const explain::Explanation& found = cases[k].found;
    if ((found.verdict != Verdict::ambiguous && found.hints.empty()) || !found.next_experiment) continue;
    const std::string& proposed = found.next_experiment->toml;
    const Instruments needed = asked_for(proposed);
    if (needed.radius) {
      fmt::print("- {}: asks for an image at rest, not run\n", explain::hidden_words(cases[k]));
      continue;
    }
    Truth truth = cases[k].truth;
    truth.name = asked[k].study.stem().stem().string() + "-next";
    const fs::path experiment = experiment_of(truth);
    if (!fs::exists(experiment) || read_whole_file(experiment) != proposed)
      fs::remove(round.folder / (truth.name + ".run.h5"));
    write(experiment, proposed);
    std::string text = read_whole_file(asked[k].study);
    const std::string runs = fmt::format("runs = [\"{}.run.h5\"", cases[k].truth.name);
    put(text, runs, fmt::format("{}, \"{}.run.h5\"", runs, truth.name));
    if (needed.shear_test) {
      std::mt19937_64 random(round.sessions[k].seed);
      const double error_kPa = explain::SpecimenKnowledge{}.relative_C1_error * round.sessions[k].C1_kPa;
      const double C1_kPa = std::normal_distribution(round.sessions[k].C1_kPa, error_kPa)(random);
      const double reach_kPa = std::sqrt(3.0) * error_kPa;
      put(text, C1_lines(unknown_kPa), C1_lines({C1_kPa - reach_kPa, C1_kPa + reach_kPa}));
    }
    const fs::path study = round.folder / (truth.name + ".study.toml");
    write(study, text);
    open.push_back(k);
    again.push_back({std::move(truth), study});
    instruments.push_back(needed);
  }
  parallel_for(again.size(), 2, [&](size_t i) {
    Simulated session = round.sessions[open[i]];
    session.seed += 250;
    session.instruments = instruments[i];
    const std::string& name = again[i].truth.name;
    simulate(session, round.folder, name, experiment_of(again[i].truth));
    const fs::path answered = kept / (name + ".json");  // of an earlier run of another experiment?
    if (fs::exists(answered) &&
        fs::last_write_time(answered) < fs::last_write_time(round.folder / (name + ".run.h5")))
      fs::remove(answered);
  });
  std::vector<ScoredCase> found = answers(again, kept, resume);
  for (size_t i = 0; i < found.size(); ++i)
    fmt::print("{} {}{}: {} -> {}\n", is_truth(found[i]) ? " " : "x", explain::hidden_words(found[i]),
               in_words(instruments[i]), explain::answer_of(cases[open[i]].found),
               explain::answer_of(found[i].found));
  return found;
}

struct World3 {
  std::vector<ScoredCase> alone, with_reference;
  std::vector<ScoredCase> again;  ///< with what was proposed
};

World3 simulated_world(const WorldsOptions& options) {
  World3 world;
  for (uint64_t number = options.first_round; number < options.first_round + options.rounds; ++number) {
    const fs::path folder = options.kept / fmt::format("rig-{}", number);
    const Round round = simulated_round(number, folder);
    std::vector<ScoredCase> a = answers(round.alone, folder / "alone", options.resume);
    std::vector<ScoredCase> b = answers(round.with_reference, folder / "with-reference", options.resume);
    // Nothing is hidden in the first two: what they differ by is noise.
    const fs::path& clean = round.alone[0].study;
    const double noise_kPa2 = difference_kPa2(round.alone[1].study, clean);
    for (size_t k = 0; k < a.size(); ++k) {
      const fs::path& study = round.alone[k].study;
      const double change_kPa2 =
          a[k].truth.kind == explain::TruthKind::pair
              ? std::min(difference_kPa2(round.of_first(k), clean), difference_kPa2(study, round.of_first(k)))
              : difference_kPa2(study, clean);
      // The rig's own error is what its references left.
      const double times =
          1e3 * std::sqrt(std::max(0.0, change_kPa2 - noise_kPa2)) / b[k].found.model_error->rms_Pa;
      for (ScoredCase* one : {&a[k], &b[k]})
        one->truth.size = times >= 5   ? EffectSize::large
                          : times >= 2 ? EffectSize::medium
                                       : EffectSize::small;
    }
    if (options.proposals) {
      fmt::print("\nRig {}: what was hidden: before -> with the proposed experiment\n", number);
      std::ranges::move(asked_again(round, round.alone, a, folder / "alone-next", options.resume),
                        std::back_inserter(world.again));
      std::ranges::move(
          asked_again(round, round.with_reference, b, folder / "with-reference-next", options.resume),
          std::back_inserter(world.again));
    }
    std::ranges::move(a, std::back_inserter(world.alone));
    std::ranges::move(b, std::back_inserter(world.with_reference));
  }
  return world;
}

}  // namespace

bool explain_worlds(const WorldsOptions& options) {
  if (!options.resume) fs::remove_all(options.kept);
  std::vector<ScoredCase> all;
  bool met = true;
  const auto add = [&](const std::string& title, const std::vector<ScoredCase>& cases,
                       const explain::Targets& targets) {
    met = report(title, cases, targets) && met;
    all.insert(all.end(), cases.begin(), cases.end());
  };
  for (const int world : options.worlds) {
    if (world == 1)
      add("World 1: exact model",
          answers(recorded(options.data / "rig", ".study.toml"), options.kept / "world-1", options.resume),
          explain::exact_model);
    if (world == 2) {
      add("World 2: rigs with imperfections, two references each",
          answers(recorded(options.data / "rig2", "-with-reference.study.toml"),
                  options.kept / "world-2-with-reference", options.resume),
          {});
      add("World 2, no reference",
          answers(recorded(options.data / "rig2", ".study.toml"), options.kept / "world-2", options.resume),
          explain::no_reference);
    }
    if (world == 3) {
      const World3 own = simulated_world(options);
      if (options.proposals) report_proposals(own.again);
      add("World 3: the project's simulated rig, two references each", own.with_reference, {});
      add("World 3, no reference", own.alone, explain::no_reference);
    }
  }
  report("All", all,
         {.none_named = 1,
          .large_exact = 0,
          .medium_inside = 0,
          .small_wrong = 1,
          .pairs_exact = 0,
          .pairs_false = 1,
          .outside_named = 1,
          .any_wrong = 1,
          .interval = {0, 1}});
  return met;
}

}  // namespace diastole::bench
