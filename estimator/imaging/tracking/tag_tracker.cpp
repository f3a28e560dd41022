#include "estimator/imaging/tracking/tag_tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "estimator/imaging/tracking/ghost_phase.hpp"
#include "estimator/imaging/tracking/image_fit.hpp"
#include "estimator/imaging/tracking/joint_motion.hpp"
#include "estimator/imaging/tracking/rest_waves.hpp"
#include "estimator/imaging/tracking/seen_motion.hpp"
#include "estimator/imaging/tracking/tag_noise.hpp"

namespace diastole::imaging {
namespace {

/// Tags sample the motion once a spacing, and so resolve waves of two spacings and longer: half of them is one.
constexpr double knots_in_spacings = 2.0;
/// Before anything is learnt: motion from phase to phase of a fifth of a spacing, alike over some spacings.
constexpr double first_step_in_spacings = 0.2;
constexpr double first_range_in_spacings = 4.0;
/// Ranges to choose from by evidence: kappa = 1 / (these times the spacing).
constexpr std::array ranges_in_spacings = {4.0, 16.0};
/// Of a map that has tissue.
constexpr Eigen::Index least_tissue_pixels = 200;
constexpr double settled_mm = 0.005;
/// How far around a place that a person saw the start of a search may be led: ranges to choose from, in spacings.
constexpr std::array led_ranges_in_spacings = {1.0, 2.0, 4.0};

/// All pixels that tissue may reach in the cycle: half a spacing around the first map and more, and what is within drawn contours.
std::vector<TissuePixel> pixels_in_reach(const TagView& view, const MaterialMap& map, double spacing_mm) {
  const Eigen::ArrayXXf depth = depth_mm(map, Material::tissue, view.plane);
  const auto is_drawn = [&](Eigen::Index row, Eigen::Index column) {
    return std::any_of(view.edits.begin(), view.edits.end(), [&](const PhaseEdits& edits) {
      return edits.within_outer && (*edits.within_outer)(row, column);
    });
  };
  std::vector<TissuePixel> pixels;
  for (Eigen::Index column = 0; column < map.cols(); ++column) {
    for (Eigen::Index row = 0; row < map.rows(); ++row) {
      if (static_cast<double>(depth(row, column)) < -0.75 * spacing_mm && !is_drawn(row, column)) continue;
      pixels.push_back({row, column, view.place_mm(row, column), {}});
    }
  }
  return pixels;
}

SplinePlane splines_over(const std::vector<TissuePixel>& pixels, double spacing_mm) {
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(pixels.size()));
  for (size_t i = 0; i < pixels.size(); ++i)
    places.col(static_cast<Eigen::Index>(i)) = pixels[i].x_mm;
  return {places, knots_in_spacings * spacing_mm};
}

class ViewTracker {
 public:
  /// `first`: the materials that tracking begins with.
  ViewTracker(const TagView& view, RestWaves rest, const MaterialMap& first)
      : view_(view),
        rest_(std::move(rest)),
        spacing_mm_(rest_.waves[0].spacing_mm()),
        pixels_(pixels_in_reach(view, first, spacing_mm_)),
        splines_(splines_over(pixels_, spacing_mm_)),
        seen_(view, rest_.waves, splines_),
        image_fit_(view, rest_.waves, pixels_),
        first_precision_(splines_.precision(1.0 / (first_range_in_spacings * spacing_mm_))),
        coefficients_(directions(),
                      Eigen::MatrixXd::Zero(splines_.count(), static_cast<Eigen::Index>(times()))),
        phases_(times()) {
    for (TissuePixel& pixel : pixels_)
      pixel.splines = splines_.at(pixel.x_mm);
  }
  ViewTracker(const ViewTracker&) = delete;
  ViewTracker& operator=(const ViewTracker&) = delete;

  TrackedView track(const MaterialMap& first) {
    follow(first);
    fit_all_phases();
    return result();
  }

 private:
  [[nodiscard]] size_t directions() const { return rest_.waves.size(); }
  [[nodiscard]] size_t times() const { return view_.images.size(); }

  void find_edges(size_t k, const RestPatterns& rest) {
    PatternMaps tissue = rest.fixed;
    for (const TissuePixel& pixel : pixels_) {
      const TagPatterns patterns = image_fit_.patterns_at(pixel, k, coefficients_);
      for (size_t i = 0; i < patterns.count; ++i)
        tissue[i](pixel.row, pixel.column) = patterns.value[i];
    }
    const TrackedPhase& before = phases_[k];
    set_materials(k, refined_materials(k, view_, before.materials, before.depth_mm, tissue, rest));
  }

  void set_materials(size_t k, MaterialMap map) {
    if (!view_.edits.empty()) draw_contours(view_.edits[k], map);
    phases_[k].materials = std::move(map);
    phases_[k].depth_mm = depth_mm(phases_[k].materials, Material::tissue, view_.plane);
  }

  /// Phase after phase: motion, edge, motion.
  void follow(const MaterialMap& first) {
    const RestPatterns rest(view_, rest_.waves);
    for (size_t k = 0; k < times(); ++k) {
      const auto time = static_cast<Eigen::Index>(k);
      for (Eigen::MatrixXd& each : coefficients_) {
        if (k == 1) each.col(time) = each.col(0);
        // Half of the last step goes on: motion turns within a cycle.
        if (k >= 2) each.col(time) = each.col(time - 1) + 0.5 * (each.col(time - 1) - each.col(time - 2));
      }
      const SliceMotion expected = coefficients_;
      if (k == 0 || !view_.edits.empty()) {
        set_materials(k, k == 0 ? first : phases_[k - 1].materials);
      } else {
        phases_[k].materials = phases_[k - 1].materials;
        phases_[k].depth_mm = phases_[k - 1].depth_mm;
      }
      if (seen_.is_led(k)) {
        lead(k, expected);
      } else {
        fit_phase(k, view_.images[k], expected, 2);
      }
      find_edges(k, rest);
      if (k == 0) find_edges(k, rest);
      fit_phase(k, view_.images[k], seen_.is_led(k) ? coefficients_ : expected, 4);
      if (seen_.is_led(k)) put_right_before(k, rest);
    }
  }

  /// Searches once more from starts that go through what a person saw, and less and less far around it; keeps the end that explains
  /// image, person and expectation best. A line that jumped to the next stripe fits its own surroundings as well as the right one, and
  /// no search leads out of there.
  void lead(size_t k, const SliceMotion& expected) {
    const auto time = static_cast<Eigen::Index>(k);
    const double step_mm = first_step_in_spacings * spacing_mm_;
    SliceMotion best;
    double least = 0, noise = 0;
    for (const double range : led_ranges_in_spacings) {
      const Eigen::MatrixXd prior = splines_.precision(1.0 / (range * spacing_mm_)) / (step_mm * step_mm);
      coefficients_ = expected;
      for (size_t f = 0; f < directions(); ++f) {
        const PhaseInformation seen = seen_.information(k, f);
        coefficients_[f].col(time) =
            (seen.precision + prior).ldlt().solve(seen.vector + prior * expected[f].col(time));
      }
      const SliceMotion start = coefficients_;
      fit_phase(k, view_.images[k], start, 4);
      explain(k);
      if (best.empty()) noise = phases_[k].noise;
      double cost = image_fit_.cost(noise) + step_cost(coefficients_, k, expected, k);
      for (size_t f = 0; f < directions(); ++f)
        cost += seen_.cost(k, f, coefficients_[f].col(time));
      if (!best.empty() && cost >= least) continue;
      least = cost;
      best = coefficients_;
    }
    coefficients_ = std::move(best);
  }

  /// A line that a person puts right in phase k jumped there or in a phase before. Goes back from k, and takes what is found so from
  /// the phase on at which image and steps from phase to phase together cost least.
  void put_right_before(size_t k, const RestPatterns& rest) {
    const SliceMotion right = coefficients_;
    SliceMotion back = right;
    double gain = 0, most = 0;  // in cost, over no change
    size_t from = k;
    for (size_t j = k; j-- > 0 && !seen_.is_led(j);) {
      const auto time = static_cast<Eigen::Index>(j);
      coefficients_ = right;
      explain(j);
      const double noise = phases_[j].noise;
      const TrackedPhase before = phases_[j];
      const double cost = image_fit_.cost(noise) + step_cost(right, j, right, j + 1);
      coefficients_ = back;
      double apart_mm = 0;
      for (size_t f = 0; f < directions(); ++f) {
        coefficients_[f].col(time) = back[f].col(time + 1);
        if (j + 2 <= k) coefficients_[f].col(time) += 0.5 * (back[f].col(time + 1) - back[f].col(time + 2));
      }
      const SliceMotion start = coefficients_;
      fit_phase(j, view_.images[j], start, 4);
      explain(j);
      back = coefficients_;
      for (size_t f = 0; f < directions(); ++f)
        apart_mm = std::max(apart_mm, (back[f].col(time) - right[f].col(time)).cwiseAbs().maxCoeff());
      gain += cost - image_fit_.cost(noise) - step_cost(back, j, back, j + 1);
      phases_[j] = before;
      // The step across which the two ways meet; before the first phase is rest.
      const SliceMotion rested(directions(), Eigen::MatrixXd::Zero(splines_.count(), 1));
      const SliceMotion& earlier = j == 0 ? rested : right;
      const size_t then = j == 0 ? 0 : j - 1;
      const double met = step_cost(earlier, then, right, j) - step_cost(earlier, then, back, j);
      if (gain + met > most) {
        most = gain + met;
        from = j;
      }
      if (apart_mm < first_step_in_spacings * spacing_mm_) break;
    }
    coefficients_ = right;
    for (size_t j = from; j < k; ++j) {
      for (size_t f = 0; f < directions(); ++f)
        coefficients_[f].col(static_cast<Eigen::Index>(j)) = back[f].col(static_cast<Eigen::Index>(j));
    }
    for (size_t j = from; j < k; ++j) {
      find_edges(j, rest);
      fit_phase(j, view_.images[j], coefficients_, 4);
    }
  }

  /// Minus the log prior density of the step between two phases.
  [[nodiscard]] double step_cost(const SliceMotion& a, size_t k_a, const SliceMotion& b, size_t k_b) const {
    const double step_mm = first_step_in_spacings * spacing_mm_;
    double sum = 0;
    for (size_t f = 0; f < directions(); ++f) {
      const Eigen::VectorXd step =
          a[f].col(static_cast<Eigen::Index>(k_a)) - b[f].col(static_cast<Eigen::Index>(k_b));
      sum += 0.5 * step.dot(first_precision_ * step) / (step_mm * step_mm);
    }
    return sum;
  }

  void fit_phase(size_t k, const Image& image, const SliceMotion& expected, int most_rounds) {
    const auto time = static_cast<Eigen::Index>(k);
    const double step_mm = first_step_in_spacings * spacing_mm_;
    const Eigen::MatrixXd prior = first_precision_ / (step_mm * step_mm);
    for (int round = 0; round < most_rounds; ++round) {
      double largest = 0;
      for (size_t f = 0; f < directions(); ++f) {
        explain(k, image);
        PhaseInformation information = information_in(k, f);
        const Eigen::VectorXd now = coefficients_[f].col(time);
        if (seen_.is_led(k, f)) {
          const PhaseInformation seen = seen_.information(k, f);
          information.precision += seen.precision;
          information.vector += seen.vector - seen.precision * now;
        }
        const Eigen::VectorXd step = (information.precision + prior)
                                         .llt()
                                         .solve(information.vector + prior * (expected[f].col(time) - now));
        coefficients_[f].col(time) += step;
        largest = std::max(largest, step.cwiseAbs().maxCoeff());
      }
      if (largest < settled_mm) break;
    }
  }

  /// The image at the present motion; residuals and slopes are kept.
  void explain(size_t k, const Image& image) { image_fit_.explain(k, image, coefficients_, phases_[k]); }
  void explain(size_t k) { explain(k, view_.images[k]); }

  [[nodiscard]] PhaseInformation information_in(size_t k, size_t f) const {
    return image_fit_.information(phases_[k], excess_, f, splines_.count());
  }

  /// Noise power near the tags' frequency over the mean. A narrow wall blurs the spectrum, so that what the fit takes of the noise at the tags'
  /// frequency is missing beside it too: as much as it takes of white noise that is put in the residual's place.
  double noise_factor(size_t f) {
    double seen = 0, counted = 0;
    for (size_t k = 0; k < times(); ++k) {
      if (phases_[k].pixels == 0) continue;
      seen += power_near_tags(phases_[k], excess_, view_.plane, rest_.waves[f], spacing_mm_);
      counted += 1;
    }
    std::mt19937 engine(20);
    double kept = 0, tried = 0;
    for (const size_t k : {size_t{0}, times() / 2, times() - 1}) {
      if (phases_[k].pixels == 0) continue;
      std::normal_distribution<float> white(0.0F, static_cast<float>(phases_[k].noise));
      const Image image = (view_.images[k] - phases_[k].residual).unaryExpr([&](float value) {
        return value + white(engine);
      });
      const TrackedPhase before = phases_[k];
      const SliceMotion coefficients = coefficients_;
      fit_phase(k, image, coefficients, 2);
      explain(k, image);
      kept += power_near_tags(phases_[k], excess_, view_.plane, rest_.waves[f], spacing_mm_);
      tried += 1;
      coefficients_ = coefficients;
      phases_[k] = before;
    }
    return std::clamp((seen / std::max(counted, 1.0)) / std::max(kept / std::max(tried, 1.0), 0.1), 0.2,
                      10.0);
  }

  void fit_all_phases() {
    excess_ = ResidualExcess(phases_, view_.plane, spacing_mm_);
    for (size_t f = 0; f < directions(); ++f)
      factors_.push_back(noise_factor(f));
    std::vector<double> kappas;
    for (const double range : ranges_in_spacings)
      kappas.push_back(1.0 / (range * spacing_mm_));
    // The prior is learnt from estimates phase by phase first, and then from its own.
    std::vector<MotionPrior> priors(directions());
    joint_.resize(directions());
    for (const bool last : {false, true}) {
      for (size_t f = 0; f < directions(); ++f) {
        const std::vector<PhaseInformation> found = informations(f);
        priors[f] = learn_motion_prior(splines_, found, coefficients_[f], kappas);
        joint_[f] = fit_jointly(priors[f], found, last);
        coefficients_[f] = joint_[f].coefficients;
      }
    }
    kappa_per_mm_ = priors[0].kappa_per_mm;
    for (size_t k = 0; k < times(); ++k)
      explain(k);
  }

  std::vector<PhaseInformation> informations(size_t f) {
    std::vector<PhaseInformation> all;
    for (size_t k = 0; k < times(); ++k) {
      explain(k);
      PhaseInformation here = information_in(k, f);
      here.vector += here.precision * coefficients_[f].col(static_cast<Eigen::Index>(k));
      here.precision /= factors_[f];
      here.vector /= factors_[f];
      if (seen_.is_led(k, f)) {
        const PhaseInformation seen = seen_.information(k, f);
        here.precision += seen.precision;
        here.vector += seen.vector;
      }
      all.push_back(std::move(here));
    }
    return all;
  }

  TrackedView result() {
    TrackedView tracked;
    tracked.waves = rest_.waves;
    for (size_t f = 0; f < directions(); ++f)
      tracked.motion.push_back({splines_, std::move(joint_[f].coefficients), std::move(joint_[f].covariance),
                                spacing_mm_ * spacing_mm_ * factors_[f] * rest_.information[f].inverse(),
                                0.5 * view_.extent_mm(), view_.extent_mm().norm()});
    tracked.phases = std::move(phases_);
    tracked.excess = std::move(excess_);
    tracked.noise_factor = factors_;
    tracked.kappa_per_mm = kappa_per_mm_;
    return tracked;
  }

  const TagView& view_;
  RestWaves rest_;
  double spacing_mm_;
  std::vector<TissuePixel> pixels_;
  SplinePlane splines_;
  SeenMotion seen_;
  ImageFit image_fit_;
  Eigen::MatrixXd first_precision_;
  SliceMotion coefficients_;
  std::vector<TrackedPhase> phases_;
  ResidualExcess excess_;  // before all phases are fitted together: none
  std::vector<double> factors_;
  double kappa_per_mm_ = 0;
  std::vector<JointMotion> joint_;
};

/// A view as it is, without a search for ghosts.
TrackedView tracked_once(const TagView& view, std::optional<TrackingFault>& fault) {
  MaterialMap first = first_materials(view);
  if (!view.edits.empty()) draw_contours(view.edits[0], first);
  if ((first == Material::tissue).count() < least_tissue_pixels) {
    fault = TrackingFault{
        "no tissue was found: nothing whose tags fade within a cycle and that is two spacings wide"};
    return {};
  }
  return ViewTracker(view, waves_at_rest(view, first), first).track(first);
}

}  // namespace

TrackedView track_view(const TagView& view, std::optional<TrackingFault>& fault) {
  fault.reset();
  TrackedView tracked = tracked_once(view, fault);
  if (fault) return tracked;
  std::vector<const MaterialMap*> maps;
  std::vector<double> noise;
  for (const TrackedPhase& phase : tracked.phases) {
    maps.push_back(&phase.materials);
    noise.push_back(phase.noise);
  }
  std::vector<Ghost> ghosts = find_ghosts(view, maps, noise);
  if (ghosts.empty()) return tracked;
  for (Ghost& ghost : ghosts)
    measure_in_phase(view, tracked, ghost);
  const TagView clean = without_ghosts(view, tracked, ghosts);
  tracked = tracked_once(clean, fault);
  tracked.ghosts = std::move(ghosts);
  return tracked;
}

}  // namespace diastole::imaging
