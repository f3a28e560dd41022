#include "estimator/imaging/tracking/materials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "estimator/imaging/tracking/brightness.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {
namespace {

/// Of the largest piece of tissue (remove_specks).
constexpr double least_share = 0.1;

/// Water that is stirred loses its tags within a phase or two, tissue keeps them for its T1 of 0.3 to 1.5 s, still water for 2 s and more.
constexpr std::array typical_T1_s = {0.1, 0.8, 3.0};
constexpr double least_still_T1_s = 2.0;
/// Of the pixels of a band a twentieth wider than a spacing so many are half a spacing deep; tissue is two spacings wide, and of what lies
/// between two materials noise makes a hundredth so deep.
constexpr double boundary_share = 0.05;
/// Darker than a quarter of what is bright: plates, air, and the noise of both.
constexpr double least_brightness = 0.25;
/// A pixel that no material explains (a ghost, a fold) should not outvote its neighbours: 3 standard deviations.
constexpr double most_cost = 9.0;
/// Pictures of materials are smooth to about this share of their brightness.
constexpr double smooth_share = 0.05;
/// Each pixel is judged with its neighbours: a binomial window of this many passes has a standard deviation of one pixel.
constexpr int pooling_passes = 2;

/// The windowed mean and the modulation of one image, at every pixel of a coarser raster.
struct Modulation {
  std::vector<double> mean;
  std::vector<double> share;  // of the mean
};

constexpr Eigen::Index raster = 2;  // pixels

Modulation modulation_of(const TagView& view, size_t k, const PatternMaps& free) {
  const Image& image = view.images[k];
  const double window_mm = 0.5 / view.waves[0].per_mm.norm();
  const size_t count = free.size();
  Brightness brightness(view.extent_mm(), window_mm, static_cast<int>(count));
  std::array<double, 5> patterns{};
  for (Eigen::Index row = 0; row < image.rows(); ++row) {
    for (Eigen::Index column = 0; column < image.cols(); ++column) {
      if (view.is_masked(k, row, column)) continue;
      for (size_t i = 0; i < count; ++i)
        patterns[i] = free[i](row, column);
      brightness.add(view.place_mm(row, column), std::span(patterns).first(count), 1.0,
                     static_cast<double>(image(row, column)));
    }
  }
  brightness.solve(Brightness::Places::all);
  Modulation result;
  std::array<double, 5> amplitudes{};
  for (Eigen::Index row = 0; row < image.rows(); row += raster) {
    for (Eigen::Index column = 0; column < image.cols(); column += raster) {
      brightness.at(view.place_mm(row, column), std::span(amplitudes).first(count));
      double most = 0;
      for (size_t i = 1; i < count; i += 2)
        most = std::max(most, std::hypot(amplitudes[i], amplitudes[i + 1]));
      result.mean.push_back(amplitudes[0]);
      result.share.push_back(amplitudes[0] > 0 ? std::min(1.0, most / amplitudes[0]) : 0.0);
    }
  }
  return result;
}

/// Longitudinal magnetisation that the tags still hold, from the modulation r of 1 - E (1 + cos phi) / 2: E = 2 r / (1 + r).
double left_of(double share) { return 2 * share / (1 + share); }

/// How a material's tags fade over the chosen phases: E of each.
using Fading = std::vector<double>;

double square_distance(const Fading& a, const Fading& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i)
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

size_t nearest(const std::array<Fading, 3>& centres, const Fading& fading) {
  size_t best = 0;
  for (size_t i = 1; i < centres.size(); ++i) {
    if (square_distance(centres[i], fading) < square_distance(centres[best], fading)) best = i;
  }
  return best;
}

/// k-means from what typical materials do; a material that does not occur keeps its typical course.
std::array<Fading, 3> grouped(const std::vector<Fading>& samples, const std::vector<double>& times_s) {
  std::array<Fading, 3> centres;
  for (size_t i = 0; i < 3; ++i) {
    for (const double time_s : times_s)
      centres[i].push_back(std::exp(-time_s / typical_T1_s[i]));
  }
  for (int step = 0; step < 20; ++step) {
    std::array<Fading, 3> sums;
    sums.fill(Fading(times_s.size(), 0.0));
    std::array<double, 3> counts{};
    for (const Fading& sample : samples) {
      const size_t group = nearest(centres, sample);
      for (size_t k = 0; k < sample.size(); ++k)
        sums[group][k] += sample[k];
      counts[group] += 1;
    }
    for (size_t i = 0; i < 3; ++i) {
      for (size_t k = 0; k < times_s.size() && counts[i] > 0; ++k)
        centres[i][k] = sums[i][k] / counts[i];
    }
  }
  return centres;
}

/// The course of a group's median sample: the few at its boundaries do not count.
Fading median_course(const std::array<Fading, 3>& centres, size_t group, const std::vector<Fading>& samples) {
  std::vector<std::vector<double>> values(centres[group].size());
  for (const Fading& sample : samples) {
    if (nearest(centres, sample) != group) continue;
    for (size_t k = 0; k < sample.size(); ++k)
      values[k].push_back(sample[k]);
  }
  if (values[0].empty()) return centres[group];
  Fading course;
  for (std::vector<double>& each : values)
    course.push_back(signal::quantile(each, 0.5));
  return course;
}

/// T1 by the slope of the logarithm; each phase has the same noise, hence weights E^2. Infinite where nothing fades.
double T1_of(const Fading& course, const std::vector<double>& times_s) {
  double weights = 0, time = 0, level = 0;
  for (size_t k = 0; k < course.size(); ++k) {
    const double weight = course[k] * course[k];
    weights += weight;
    time += weight * times_s[k];
    level += weight * std::log(std::max(course[k], 1e-3));
  }
  double square = 0, product = 0;
  for (size_t k = 0; k < course.size(); ++k) {
    const double off_s = times_s[k] - time / weights;
    square += course[k] * course[k] * off_s * off_s;
    product += course[k] * course[k] * off_s * (std::log(std::max(course[k], 1e-3)) - level / weights);
  }
  return product < 0 ? -square / product : std::numeric_limits<double>::infinity();
}

/// Nodes of the raster, column by row, that hold a material. The windowed mean reaches beyond an edge to nothing, where it has half of what is
/// beside it; away from such an edge a dark material may lie beside a bright one.
std::vector<bool> materials_there(const std::vector<double>& mean, size_t nodes_a_row,
                                  double reach_in_nodes) {
  const double bright = signal::quantile(mean, 0.9);
  const auto rows = static_cast<Eigen::Index>(mean.size() / nodes_a_row);
  const auto columns = static_cast<Eigen::Index>(nodes_a_row);
  const auto reach = static_cast<Eigen::Index>(reach_in_nodes);
  std::vector<bool> there(mean.size());
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (Eigen::Index column = 0; column < columns; ++column) {
      double darkest = std::numeric_limits<double>::infinity(), brightest = 0;
      for (Eigen::Index r = std::max<Eigen::Index>(0, row - reach); r <= std::min(rows - 1, row + reach);
           ++r) {
        for (Eigen::Index c = std::max<Eigen::Index>(0, column - reach);
             c <= std::min(columns - 1, column + reach); ++c) {
          const double value = mean[static_cast<size_t>(r * columns + c)];
          darkest = std::min(darkest, value);
          brightest = std::max(brightest, value);
        }
      }
      const auto at = static_cast<size_t>(row * columns + column);
      const bool is_at_nothing = darkest < least_brightness * bright;
      there[at] = mean[at] >= least_brightness * bright && !(is_at_nothing && mean[at] < 0.5 * brightest);
    }
  }
  return there;
}

using CostMap = Eigen::ArrayXXf;

void pool(CostMap& cost) {
  const Eigen::Index rows = cost.rows();
  const Eigen::Index columns = cost.cols();
  for (int pass = 0; pass < pooling_passes; ++pass) {
    CostMap across = cost;
    for (Eigen::Index column = 0; column < columns; ++column)
      across.col(column) = 0.25F * cost.col(std::max<Eigen::Index>(column - 1, 0)) + 0.5F * cost.col(column) +
                           0.25F * cost.col(std::min(column + 1, columns - 1));
    for (Eigen::Index row = 0; row < rows; ++row)
      cost.row(row) = 0.25F * across.row(std::max<Eigen::Index>(row - 1, 0)) + 0.5F * across.row(row) +
                      0.25F * across.row(std::min(row + 1, rows - 1));
  }
}

/// One pass of the squared distance transform of sampled functions (Felzenszwalb and Huttenlocher, Theory Comput. 8 (2012) 415).
void lower_envelope(std::span<float> values, double spacing_mm, std::vector<double>& scratch) {
  const auto count = static_cast<int>(values.size());
  scratch.assign(values.begin(), values.end());
  std::vector<int> vertex(values.size());
  std::vector<double> from(values.size() + 1);
  int last = 0;
  const auto crossing = [&](int a, int b) {
    const double square = spacing_mm * spacing_mm;
    return ((scratch[static_cast<size_t>(b)] + square * b * b) -
            (scratch[static_cast<size_t>(a)] + square * a * a)) /
           (2 * square * (b - a));
  };
  from[0] = -std::numeric_limits<double>::infinity();
  from[1] = std::numeric_limits<double>::infinity();
  for (int q = 1; q < count; ++q) {
    double at = crossing(vertex[static_cast<size_t>(last)], q);
    while (at <= from[static_cast<size_t>(last)]) {
      --last;
      at = crossing(vertex[static_cast<size_t>(last)], q);
    }
    vertex[static_cast<size_t>(++last)] = q;
    from[static_cast<size_t>(last)] = at;
    from[static_cast<size_t>(last) + 1] = std::numeric_limits<double>::infinity();
  }
  int at = 0;
  for (int q = 0; q < count; ++q) {
    while (from[static_cast<size_t>(at) + 1] < q)
      ++at;
    const int v = vertex[static_cast<size_t>(at)];
    const double step = spacing_mm * (q - v);
    values[static_cast<size_t>(q)] = static_cast<float>(step * step + scratch[static_cast<size_t>(v)]);
  }
}

/// The distance of every pixel to the nearest one that `is_source`, 1e4 mm if there is none.
Eigen::ArrayXXf distance_to(const PixelMask& is_source, const SlicePlane& plane) {
  constexpr float far_mm2 = 1e8F;
  Eigen::ArrayXXf square(is_source.rows(), is_source.cols());
  const auto step_mm = static_cast<float>(plane.row_spacing_mm);
  for (Eigen::Index column = 0; column < square.cols(); ++column) {
    float apart_mm = 1e4F;
    for (Eigen::Index row = 0; row < square.rows(); ++row) {
      apart_mm = is_source(row, column) ? 0.0F : apart_mm + step_mm;
      square(row, column) = apart_mm;
    }
    for (Eigen::Index row = square.rows(); row-- > 0;) {
      apart_mm = std::min(square(row, column), apart_mm + step_mm);
      square(row, column) = std::min(apart_mm * apart_mm, far_mm2);
    }
  }
  std::vector<double> scratch;
  std::vector<float> line(static_cast<size_t>(square.cols()));
  for (Eigen::Index row = 0; row < square.rows(); ++row) {
    Eigen::Map<Eigen::ArrayXf> view(line.data(), square.cols());
    view = square.row(row).transpose();
    lower_envelope(line, plane.column_spacing_mm, scratch);
    square.row(row) = view.transpose();
  }
  return square.min(far_mm2).sqrt();
}

/// Connected pixels (by sides) for which `holds`, each piece handed to `piece`.
template <class Holds, class Piece>
void each_piece(const MaterialMap& map, const Holds& holds, const Piece& piece) {
  std::vector<bool> seen(static_cast<size_t>(map.size()));
  std::vector<Eigen::Index> members;
  for (Eigen::Index start = 0; start < map.size(); ++start) {
    if (seen[static_cast<size_t>(start)] || !holds(map(start))) continue;
    members.assign(1, start);
    seen[static_cast<size_t>(start)] = true;
    for (size_t i = 0; i < members.size(); ++i) {
      const Eigen::Index row = members[i] % map.rows();
      const Eigen::Index column = members[i] / map.rows();
      const auto visit = [&](Eigen::Index r, Eigen::Index c) {
        if (r < 0 || c < 0 || r >= map.rows() || c >= map.cols()) return;
        const Eigen::Index at = c * map.rows() + r;
        if (seen[static_cast<size_t>(at)] || !holds(map(at))) return;
        seen[static_cast<size_t>(at)] = true;
        members.push_back(at);
      };
      visit(row - 1, column);
      visit(row + 1, column);
      visit(row, column - 1);
      visit(row, column + 1);
    }
    piece(members);
  }
}

/// Where a picture is fitted, and where it is asked for.
struct Region {
  PixelMask sure, wanted;
};

/// A material's picture, fitted where it surely is and predicted where it is wanted.
CostMap cost_of(size_t k, const TagView& view, const Region& region, double window_mm,
                const PatternMaps& patterns, double noise) {
  const Image& image = view.images[k];
  const size_t count = patterns.size();
  CostMap cost = CostMap::Constant(image.rows(), image.cols(), static_cast<float>(most_cost));
  Brightness brightness(view.extent_mm(), window_mm, static_cast<int>(count));
  std::array<double, 5> here{}, amplitudes{};
  const auto look = [&](Eigen::Index row, Eigen::Index column) {
    for (size_t i = 0; i < count; ++i)
      here[i] = patterns[i](row, column);
  };
  Eigen::Index pixels = 0;
  for (Eigen::Index column = 0; column < image.cols(); ++column) {
    for (Eigen::Index row = 0; row < image.rows(); ++row) {
      if (!region.sure(row, column) || view.is_masked(k, row, column)) continue;
      look(row, column);
      brightness.add(view.place_mm(row, column), std::span(here).first(count), 1.0,
                     static_cast<double>(image(row, column)));
      ++pixels;
    }
  }
  if (pixels < 50) return cost;
  brightness.solve(Brightness::Places::all);
  for (Eigen::Index column = 0; column < image.cols(); ++column) {
    for (Eigen::Index row = 0; row < image.rows(); ++row) {
      if (!region.wanted(row, column)) continue;
      look(row, column);
      const double picture =
          brightness.picture(view.place_mm(row, column), std::span(here).first(count), amplitudes);
      const double doubt = smooth_share * amplitudes[0];
      const double off = static_cast<double>(image(row, column)) - picture;
      cost(row, column) =
          static_cast<float>(std::min(most_cost, off * off / (noise * noise + doubt * doubt)));
    }
  }
  return cost;
}

/// The noise's standard deviation: half differences of next neighbours but one along both directions see little of stripes and
/// shading; their median absolute deviation sees no edges.
double noise_of(const Image& image, const MaterialMap& map) {
  std::vector<double> off;
  for (Eigen::Index column = 1; column + 1 < image.cols(); ++column) {
    for (Eigen::Index row = 1; row + 1 < image.rows(); ++row) {
      if (map(row, column) == Material::nothing) off.push_back(static_cast<double>(image(row, column)));
    }
  }
  // Air shows the Rayleigh distribution, whose median is 1.1774 times the standard deviation of a channel.
  return signal::quantile(off, 0.5) / 1.1774;
}

PixelMask where(const MaterialMap& map, Material material) {
  return map.unaryExpr([material](Material here) { return here == material; });
}

}  // namespace

RestPatterns::RestPatterns(const TagView& view, const std::vector<TagWave>& waves) {
  const TagModel model(waves.size());
  const auto none = [&] { return Eigen::ArrayXXd(view.plane.rows, view.plane.columns); };
  free.assign(1 + 2 * waves.size(), none());
  fixed.assign(model.patterns(), none());
  std::array<double, 2> phases{};
  for (Eigen::Index column = 0; column < view.plane.columns; ++column) {
    for (Eigen::Index row = 0; row < view.plane.rows; ++row) {
      free[0](row, column) = 1.0;
      for (size_t f = 0; f < waves.size(); ++f) {
        phases[f] = waves[f].phase_rad(view.place_mm(row, column));
        free[1 + 2 * f](row, column) = std::cos(phases[f]);
        free[2 + 2 * f](row, column) = std::sin(phases[f]);
      }
      const TagPatterns values = model.at(std::span(phases).first(waves.size()));
      for (size_t i = 0; i < values.count; ++i)
        fixed[i](row, column) = values.value[i];
    }
  }
}

MaterialMap first_materials(const TagView& view) {
  // Six phases over the cycle distinguish three rates of fading.
  std::vector<size_t> chosen;
  const size_t phases = view.images.size();
  for (size_t i = 0; i < std::min<size_t>(6, phases); ++i)
    chosen.push_back(i * (phases - 1) / std::max<size_t>(1, std::min<size_t>(6, phases) - 1));
  std::vector<Modulation> modulations;
  std::vector<double> times_s;
  const PatternMaps free = RestPatterns(view, view.waves).free;
  for (const size_t k : chosen) {
    modulations.push_back(modulation_of(view, k, free));
    times_s.push_back(1e-3 * view.times_ms[k]);
  }
  const size_t nodes = modulations[0].mean.size();
  const auto nodes_a_row = static_cast<size_t>((view.plane.columns + raster - 1) / raster);
  const double spacing_mm = view.waves[0].spacing_mm();
  const double reach = spacing_mm / (static_cast<double>(raster) * view.plane.finer_spacing_mm());
  const std::vector<bool> first_there = materials_there(modulations.front().mean, nodes_a_row, reach);
  const std::vector<bool> last_there = materials_there(modulations.back().mean, nodes_a_row, reach);
  std::vector<Fading> fading(nodes), samples;
  for (size_t node = 0; node < nodes; ++node) {
    if (!first_there[node] || !last_there[node]) continue;
    for (const Modulation& modulation : modulations)
      fading[node].push_back(left_of(modulation.share[node]));
    samples.push_back(fading[node]);
  }
  const auto map_of = [&](const std::array<Fading, 3>& centres, Material slowest) {
    const std::array materials = {Material::mixed_water, Material::tissue, slowest};
    MaterialMap map(view.plane.rows, view.plane.columns);
    for (Eigen::Index column = 0; column < map.cols(); ++column) {
      for (Eigen::Index row = 0; row < map.rows(); ++row) {
        const Fading& here =
            fading[static_cast<size_t>(row / raster) * nodes_a_row + static_cast<size_t>(column / raster)];
        map(row, column) = here.empty() ? Material::nothing : materials[nearest(centres, here)];
      }
    }
    return map;
  };
  // What lies between two materials fades as one between them would, but is as wide as the window only.
  const auto is_boundary = [&](const MaterialMap& map) {
    const auto deep = deep_inside(map, Material::tissue, 0.5 * spacing_mm, view.plane).count();
    return static_cast<double>(deep) <
           boundary_share * static_cast<double>((map == Material::tissue).count());
  };
  const auto T1_of_slowest = [&](const std::array<Fading, 3>& centres) {
    return T1_of(median_course(centres, 2, samples), times_s);
  };
  std::array<Fading, 3> centres = grouped(samples, times_s);
  MaterialMap map = map_of(centres, Material::still_water);
  if (is_boundary(map) && T1_of_slowest(centres) < least_still_T1_s) {
    // The wall itself is among the slowest: alone, as in air, or with still water.
    std::vector<Fading> slow;
    std::copy_if(samples.begin(), samples.end(), std::back_inserter(slow),
                 [&](const Fading& sample) { return nearest(centres, sample) == 2; });
    const Fading stirred = centres[0];
    centres = grouped(slow, times_s);
    centres[0] = stirred;
    map =
        map_of(centres, T1_of_slowest(centres) < least_still_T1_s ? Material::tissue : Material::still_water);
  }
  remove_specks(map, view.plane, 4 * spacing_mm * spacing_mm);
  return map;
}

MaterialMap refined_materials(size_t k, const TagView& view, const MaterialMap& before,
                              const Eigen::ArrayXXf& depth_before_mm, const PatternMaps& tissue,
                              const RestPatterns& rest) {
  const double spacing_mm = view.waves[0].spacing_mm();
  const double sure_mm = 1.5 * view.plane.finer_spacing_mm();
  // From one map to the next the edge moves by less than half a tag spacing.
  const PixelMask may_be_tissue = depth_before_mm > static_cast<float>(-0.5 * spacing_mm);
  const double pooled_mm =
      (pooling_passes + 1) * std::max(view.plane.row_spacing_mm, view.plane.column_spacing_mm);
  const double noise = std::max(1e-6, noise_of(view.images[k], before));
  const PixelMask everywhere = PixelMask::Constant(before.rows(), before.cols(), true);
  const auto cost = [&](Material material, const PatternMaps& patterns, const PixelMask& wanted) {
    return cost_of(k, view, {deep_inside(before, material, sure_mm, view.plane), wanted}, 2 * spacing_mm,
                   patterns, noise);
  };
  std::array<CostMap, 4> costs;
  costs[static_cast<size_t>(Material::nothing)] =
      cost(Material::nothing, {Eigen::ArrayXXd::Ones(before.rows(), before.cols())}, everywhere);
  costs[static_cast<size_t>(Material::tissue)] =
      cost(Material::tissue, tissue, depth_before_mm > static_cast<float>(-0.5 * spacing_mm - pooled_mm));
  costs[static_cast<size_t>(Material::still_water)] = cost(Material::still_water, rest.fixed, everywhere);
  costs[static_cast<size_t>(Material::mixed_water)] = cost(Material::mixed_water, rest.free, everywhere);
  for (CostMap& each : costs)
    pool(each);
  MaterialMap map = before;
  for (Eigen::Index column = 0; column < map.cols(); ++column) {
    for (Eigen::Index row = 0; row < map.rows(); ++row) {
      if (view.is_masked(k, row, column)) continue;
      size_t best = static_cast<size_t>(Material::nothing);
      for (size_t i = 0; i < costs.size(); ++i) {
        if (i == static_cast<size_t>(Material::tissue) && !may_be_tissue(row, column)) continue;
        if (costs[i](row, column) < costs[best](row, column)) best = i;
      }
      map(row, column) = static_cast<Material>(best);
    }
  }
  remove_specks(map, view.plane, 4 * spacing_mm * spacing_mm);
  return map;
}

void draw_contours(const PhaseEdits& edits, MaterialMap& map) {
  if (!edits.within_inner && !edits.within_outer) return;
  for (Eigen::Index at = 0; at < map.size(); ++at) {
    Material& here = map(at);
    const bool is_tissue = here == Material::tissue;
    const bool is_cavity = here == Material::mixed_water;
    const bool in_wall = edits.within_outer ? (*edits.within_outer)(at) && (edits.within_inner || !is_cavity)
                                            : is_tissue || is_cavity;
    if (edits.within_inner && (*edits.within_inner)(at)) {
      if (is_tissue) here = Material::mixed_water;
    } else if (in_wall) {
      here = Material::tissue;
    } else if (is_tissue) {
      here = Material::nothing;
    }
  }
}

Eigen::ArrayXXf depth_mm(const MaterialMap& map, Material material, const SlicePlane& plane) {
  const PixelMask inside = where(map, material);
  const auto half = static_cast<float>(0.5 * plane.finer_spacing_mm());
  return inside.select(distance_to(!inside, plane) - half, half - distance_to(inside, plane));
}

PixelMask deep_inside(const MaterialMap& map, Material material, double least_mm, const SlicePlane& plane) {
  const PixelMask inside = where(map, material);
  PixelMask deep = inside;
  const double reach_mm = (least_mm + 0.5 * plane.finer_spacing_mm()) * (1 - 1e-9);
  const auto rows = static_cast<Eigen::Index>(reach_mm / plane.row_spacing_mm);
  const auto columns = static_cast<Eigen::Index>(reach_mm / plane.column_spacing_mm);
  for (Eigen::Index right = -columns; right <= columns; ++right) {
    for (Eigen::Index down = -rows; down <= rows; ++down) {
      if (std::hypot(static_cast<double>(down) * plane.row_spacing_mm,
                     static_cast<double>(right) * plane.column_spacing_mm) > reach_mm)
        continue;
      const Eigen::Index high = map.rows() - std::abs(down), wide = map.cols() - std::abs(right);
      if (high <= 0 || wide <= 0) continue;
      auto here = deep.block(std::max<Eigen::Index>(0, -down), std::max<Eigen::Index>(0, -right), high, wide);
      here =
          here && inside.block(std::max<Eigen::Index>(0, down), std::max<Eigen::Index>(0, right), high, wide);
    }
  }
  return deep;
}

void remove_specks(MaterialMap& map, const SlicePlane& plane, double least_mm2) {
  const double pixel_mm2 = plane.row_spacing_mm * plane.column_spacing_mm;
  const auto is_small = [&](const std::vector<Eigen::Index>& piece) {
    return static_cast<double>(piece.size()) * pixel_mm2 < least_mm2;
  };
  const auto is_tissue = [](Material here) { return here == Material::tissue; };
  size_t largest = 0;
  each_piece(map, is_tissue,
             [&](const std::vector<Eigen::Index>& piece) { largest = std::max(largest, piece.size()); });
  std::vector<Eigen::Index> specks, holes;
  each_piece(map, is_tissue, [&](const std::vector<Eigen::Index>& piece) {
    if (is_small(piece) || static_cast<double>(piece.size()) < least_share * static_cast<double>(largest))
      specks.insert(specks.end(), piece.begin(), piece.end());
  });
  for (const Eigen::Index at : specks)
    map(at) = Material::nothing;
  each_piece(
      map, [&](Material here) { return !is_tissue(here); },
      [&](const std::vector<Eigen::Index>& piece) {
        if (is_small(piece)) holes.insert(holes.end(), piece.begin(), piece.end());
      });
  for (const Eigen::Index at : holes)
    map(at) = Material::tissue;
}

}  // namespace diastole::imaging
