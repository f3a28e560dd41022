#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

#include "estimator/inference/least_squares.hpp"
#include "estimator/rig/motion.hpp"

namespace diastole::rig {
namespace {

using runfile::PumpTrace;
using runfile::RecordedRun;
using runfile::Segment;

constexpr double longest_spread_s = 0.1;
constexpr double spread_step_s = 0.005;
constexpr double quick_flank_round = 0.04;  ///< of the period: sawtooth waveforms
constexpr double coarse_s = 0.025;          ///< spacing of what nothing explains

/// The samples [first, last) of the pump trace with their quantum.
struct Counted {
  const PumpTrace& pump;
  double step_mL;
  size_t first;
  size_t last;

  [[nodiscard]] double time_s(size_t k) const { return pump.time_s[k]; }
  [[nodiscard]] double volume_mL(size_t k) const { return pump.commanded_mL[k]; }
};

size_t index_at(const PumpTrace& pump, double time_s) {
  return static_cast<size_t>(std::lower_bound(pump.time_s.begin(), pump.time_s.end(), time_s) -
                             pump.time_s.begin());
}

double quantum_mL(const RecordedRun& run) {
  const auto found = run.rig.find("volume_per_step_mL");
  if (found != run.rig.end() && std::holds_alternative<double>(found->second) &&
      std::get<double>(found->second) > 0)
    return std::get<double>(found->second);
  double least = std::numeric_limits<double>::infinity();
  for (size_t k = 1; k < run.pump.commanded_mL.size(); ++k) {
    const double change = std::abs(run.pump.commanded_mL[k] - run.pump.commanded_mL[k - 1]);
    if (change > 1e-6) least = std::min(least, change);
  }
  return std::isfinite(least) ? least : 1e-3;
}

double worst_mL(const Motion& motion, const Counted& counted) {
  double worst = 0.0;
  for (size_t k = counted.first; k < counted.last; ++k)
    worst = std::max(worst, std::abs(motion.at(counted.time_s(k)).volume_mL - counted.volume_mL(k)));
  return worst;
}

/// A cycle that goes up and down once: when it turns, and which part of either stroke is rounded at its ends.
struct CycleShape {
  double turn = 0.5;  ///< of the period
  double up_round = 0.5, down_round = 0.5;
  bool cosine = false;
};

/// Of the waveforms that the contract names; none for the others.
std::optional<CycleShape> named_shape(const Segment& segment) {
  if (segment.waveform == "parabolic") return CycleShape{};
  if (segment.waveform == "sinusoidal") return CycleShape{.cosine = true};
  constexpr double quick = 0.25, slow = 0.75;
  if (segment.waveform == "sawtooth")
    return CycleShape{slow, quick_flank_round / slow, quick_flank_round / quick};
  if (segment.waveform == "reversed-sawtooth")
    return CycleShape{quick, quick_flank_round / quick, quick_flank_round / slow};
  return {};
}

/// Cycles [first, last) of a segment.
std::vector<Stroke> shaped_strokes(const Segment& segment, const CycleShape& shape, int64_t first,
                                   int64_t last) {
  const double low = segment.offset_mL, high = low + segment.stroke_mL, period = segment.period_s;
  std::vector<Stroke> strokes;
  for (int64_t cycle = first; cycle < last; ++cycle) {
    const double start_s = segment.start_s + static_cast<double>(cycle) * period;
    const double turn_s = start_s + shape.turn * period;
    strokes.push_back({start_s, turn_s, low, high, shape.up_round, shape.cosine});
    strokes.push_back({turn_s, start_s + period, high, low, shape.down_round, shape.cosine});
  }
  return strokes;
}

/// Monotone pieces between rests and turns, as strokes with approximate times.
std::vector<Stroke> first_strokes(const Counted& counted) {
  constexpr double rest_s = 0.15;
  std::vector<Stroke> strokes;
  size_t from = counted.first;
  double direction = 0.0;
  size_t moved = from;
  const auto close = [&](size_t at) {
    if (direction != 0.0 && at > from)
      strokes.push_back(
          {counted.time_s(from), counted.time_s(at), counted.volume_mL(from), counted.volume_mL(at)});
    direction = 0.0;
  };
  for (size_t k = counted.first + 1; k < counted.last; ++k) {
    const double change = counted.volume_mL(k) - counted.volume_mL(moved);
    if (std::abs(change) < 0.5 * counted.step_mL) {
      if (direction != 0.0 && counted.time_s(k) - counted.time_s(moved) > rest_s) close(moved);
      if (direction == 0.0) from = k;
      continue;
    }
    if (direction != 0.0 && change * direction < 0.0) {
      const size_t turn = (moved + k) / 2;
      close(turn);
      from = turn;
    }
    direction = change;
    moved = k;
  }
  close(moved);
  return strokes;
}

/// How far a stroke is from the counts, in steps, by its start and end in s and its rounding.
class StrokeMisfit final : public inference::LeastSquaresProblem {
 public:
  StrokeMisfit(const Stroke& stroke, double spread_s, const Counted& counted)
      : stroke_(stroke), spread_s_(spread_s), counted_(counted) {}

  [[nodiscard]] const inference::ParameterSpace& space() const override { return space_; }
  std::optional<Eigen::VectorXd> residuals(const Eigen::VectorXd& q) override {
    const Motion motion({stroke_at(q)}, stroke_.from_mL, spread_s_);
    Eigen::VectorXd steps(static_cast<Eigen::Index>(counted_.last - counted_.first));
    for (size_t k = counted_.first; k < counted_.last; ++k)
      steps[static_cast<Eigen::Index>(k - counted_.first)] =
          (motion.at(counted_.time_s(k)).volume_mL - counted_.volume_mL(k)) / counted_.step_mL;
    return steps;
  }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& q) override {
    return inference::central_differences(*this, q);
  }
  [[nodiscard]] Stroke stroke_at(const Eigen::VectorXd& q) const {
    Stroke stroke = stroke_;
    stroke.start_s = q[0];
    stroke.end_s = std::max(q[1], q[0] + 1e-3);
    stroke.round = std::min(q[2], 0.5);
    return stroke;
  }

 private:
  inference::ParameterSpace space_{{{"start_s"}, {"end_s"}, {"round", "", 0.01, 0.5}}};
  Stroke stroke_;
  double spread_s_;
  Counted counted_;
};

/// Times and rounding of one stroke by least squares on the counts; the cosine is tried too.
Stroke fitted(const Stroke& first, double spread_s, const Counted& whole) {
  const double around = 0.6 * spread_s + 0.01;
  const Counted counted{whole.pump, whole.step_mL,
                        std::max(whole.first, index_at(whole.pump, first.start_s - around)),
                        std::min(whole.last, index_at(whole.pump, first.end_s + around))};
  const Eigen::Vector3d start(first.start_s + 0.5 * spread_s, first.end_s - 0.5 * spread_s, 0.2);
  Stroke best = first;
  double least = std::numeric_limits<double>::infinity();
  for (const bool cosine : {false, true}) {
    Stroke shape = first;
    shape.cosine = cosine;
    StrokeMisfit misfit(shape, spread_s, counted);
    const inference::SearchResult found = inference::minimise(misfit, start, {.iteration_limit = 30});
    if (found.cost() < least) {
      least = found.cost();
      best = misfit.stroke_at(found.q);
    }
  }
  return best;
}

/// Volumes that the table names, where the counts are within a step of them: a step's rounding is not the motion's.
void snap(std::vector<Stroke>& strokes, const Segment& segment, double step_mL) {
  for (Stroke& stroke : strokes) {
    for (double* volume : {&stroke.from_mL, &stroke.to_mL}) {
      for (const double named : {segment.offset_mL, segment.offset_mL + segment.stroke_mL})
        if (std::abs(*volume - named) < step_mL) *volume = named;
    }
  }
}

std::vector<Stroke> fitted_strokes(const Segment& segment, double spread_s, const Counted& counted) {
  std::vector<Stroke> strokes = first_strokes(counted);
  snap(strokes, segment, counted.step_mL);
  for (Stroke& stroke : strokes)
    stroke = fitted(stroke, spread_s, counted);
  return strokes;
}

std::vector<Stroke> coarse_strokes(const Counted& counted) {
  std::vector<Stroke> strokes;
  size_t before = counted.first;
  for (size_t k = counted.first + 1; k < counted.last; ++k) {
    if (counted.time_s(k) - counted.time_s(before) < coarse_s) continue;
    strokes.push_back(
        {counted.time_s(before), counted.time_s(k), counted.volume_mL(before), counted.volume_mL(k), 1e-6});
    before = k;
  }
  return strokes;
}

/// A stretch of time that one segment of the table describes.
struct Stretch {
  Segment segment;
  bool named = false;  ///< its waveform's cycle is known; else what lies between such segments
  Counted counted;
};

std::vector<Stretch> stretches_of(const RecordedRun& run, double step_mL) {
  std::vector<Stretch> stretches;
  size_t from = 0;
  // A named segment's motion spreads over its borders: what lies there is not the neighbours'.
  const auto between = [&](double end_s, const Segment& next) {
    const size_t to = index_at(run.pump, end_s);
    if (to > from) stretches.push_back({next, false, {run.pump, step_mL, from, to}});
  };
  for (const Segment& segment : run.segments) {
    if (segment.waveform == "hold" || !named_shape(segment)) continue;
    const size_t first = index_at(run.pump, segment.start_s - 1e-9);
    const size_t last = index_at(run.pump, segment.end_s() - 1e-9);
    between(segment.start_s - 0.5 * longest_spread_s, segment);
    stretches.push_back({segment, true, {run.pump, step_mL, first, last}});
    from = index_at(run.pump, segment.end_s() + 0.5 * longest_spread_s);
  }
  Segment rest;
  for (const Segment& segment : run.segments)
    if (segment.waveform != "hold" && !named_shape(segment)) rest = segment;
  between(run.pump.time_s.back() + 1.0, rest);
  for (size_t k = 0; k + 1 < stretches.size(); ++k) {
    // Between two named segments an unnamed one may lie, and its volumes are the better ones to snap to.
    for (const Segment& segment : run.segments) {
      const bool inside = !stretches[k].named && segment.waveform != "hold" &&
                          index_at(run.pump, segment.start_s - 1e-9) >= stretches[k].counted.first &&
                          index_at(run.pump, segment.start_s - 1e-9) < stretches[k].counted.last;
      if (inside) stretches[k].segment = segment;
    }
  }
  return stretches;
}

/// How far a cycle in the middle of a segment is from the counts of all of them, in steps, by its shape.
class CycleMisfit final : public inference::LeastSquaresProblem {
 public:
  CycleMisfit(const Segment& segment, const CycleShape& shape, double spread_s, const Counted& counted)
      : segment_(segment), shape_(shape), spread_s_(spread_s), step_mL_(counted.step_mL) {
    // The first begins from rest, the last ends there.
    const double least = segment.cycles > 2 ? 1.0 : 0.0;
    const double most = static_cast<double>(segment.cycles) - least;
    for (size_t k = counted.first; k < counted.last; ++k) {
      const double cycles = (counted.time_s(k) - segment.start_s) / segment.period_s;
      if (cycles >= least && cycles < most)
        counts_.emplace_back(segment.start_s + (cycles - std::floor(cycles)) * segment.period_s,
                             counted.volume_mL(k));
    }
    std::ranges::sort(counts_);
    constexpr size_t plenty = 1500;
    const size_t stride = counts_.size() / plenty + 1;
    for (size_t k = 0; k * stride < counts_.size(); ++k)
      counts_[k] = counts_[k * stride];
    counts_.resize((counts_.size() + stride - 1) / stride);
  }

  [[nodiscard]] const inference::ParameterSpace& space() const override { return space_; }
  std::optional<Eigen::VectorXd> residuals(const Eigen::VectorXd& q) override {
    const Motion motion(shaped_strokes(segment_, shape_at(q), -1, 2), segment_.offset_mL, spread_s_);
    Eigen::VectorXd steps(static_cast<Eigen::Index>(counts_.size()));
    for (size_t k = 0; k < counts_.size(); ++k)
      steps[static_cast<Eigen::Index>(k)] =
          (motion.at(counts_[k].first).volume_mL - counts_[k].second) / step_mL_;
    return steps;
  }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& q) override {
    return inference::central_differences(*this, q);
  }
  [[nodiscard]] CycleShape shape_at(const Eigen::VectorXd& q) const {
    return {std::clamp(q[0], 0.02, 0.98), std::clamp(q[1], 0.01, 0.5), std::clamp(q[2], 0.01, 0.5),
            shape_.cosine};
  }
  [[nodiscard]] bool is_determined() const { return std::ssize(counts_) > space_.size(); }
  [[nodiscard]] Eigen::Vector3d start() const { return {shape_.turn, shape_.up_round, shape_.down_round}; }

 private:
  inference::ParameterSpace space_{
      {{"turn", "", 0.02, 0.98}, {"up_round", "", 0.01, 0.5}, {"down_round", "", 0.01, 0.5}}};
  const Segment& segment_;
  CycleShape shape_;
  double spread_s_, step_mL_;
  std::vector<std::pair<double, double>> counts_;  // time in the first cycle, volume
};

CycleShape fitted_shape(const Stretch& stretch, double spread_s) {
  CycleMisfit misfit(stretch.segment, *named_shape(stretch.segment), spread_s, stretch.counted);
  if (!misfit.is_determined()) return *named_shape(stretch.segment);  // it was never played
  return misfit.shape_at(inference::minimise(misfit, misfit.start(), {.iteration_limit = 30}).q);
}

/// What the cycles of a segment do: what its waveform's name says, or what another maker means by it.
enum class Shapes { named, fitted };

std::vector<Stroke> strokes_with(const std::vector<Stretch>& stretches, double spread_s, Shapes shapes) {
  std::vector<Stroke> strokes;
  for (const Stretch& stretch : stretches) {
    const auto more =
        !stretch.named ? fitted_strokes(stretch.segment, spread_s, stretch.counted)
        : shapes == Shapes::named
            ? strokes_of(stretch.segment)
            : shaped_strokes(stretch.segment, fitted_shape(stretch, spread_s), 0, stretch.segment.cycles);
    strokes.insert(strokes.end(), more.begin(), more.end());
  }
  return strokes;
}

}  // namespace

std::vector<Stroke> strokes_of(const Segment& segment) {
  const auto shape = named_shape(segment);
  return shape ? shaped_strokes(segment, *shape, 0, segment.cycles) : std::vector<Stroke>{};
}

FoundMotion find_motion(const RecordedRun& run) {
  const double step_mL = quantum_mL(run);
  const Counted all{run.pump, step_mL, 0, run.pump.time_s.size()};
  const double rest_mL = run.pump.commanded_mL.front();
  const std::vector<Stretch> stretches = stretches_of(run, step_mL);
  FoundMotion best;
  best.step_mL = step_mL;
  best.worst_mL = std::numeric_limits<double>::infinity();
  for (const Shapes shapes : {Shapes::named, Shapes::fitted}) {
    for (double spread_s = 0.0; spread_s <= longest_spread_s + 1e-9; spread_s += spread_step_s) {
      const Motion motion(strokes_with(stretches, spread_s, shapes), rest_mL, spread_s);
      const double worst = worst_mL(motion, all);
      if (worst < best.worst_mL) {
        best.motion = motion;
        best.worst_mL = worst;
      }
    }
    best.explained = best.worst_mL <= 1.01 * step_mL;
    if (best.explained) break;
  }
  if (!best.explained) {
    best.motion = Motion(coarse_strokes(all), rest_mL, 2.0 * coarse_s);
    best.worst_mL = worst_mL(best.motion, all);
  }
  return best;
}

}  // namespace diastole::rig
