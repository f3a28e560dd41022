#include "estimator/reconstruction/tag_groups.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

#include "estimator/motion_residuals/tag_match.hpp"

namespace diastole {
namespace {

constexpr double normal_step = 2e-3;  // normals nearer than this are one family
constexpr double image_gap_mm = 0.5;  // between images
constexpr double image_thickness_mm = 0.2;
constexpr size_t most_images = 64, most_partners = 40;
constexpr double least_share = 0.95;

using Eigen::Vector3d;

std::vector<TagFamily> families_of(std::span<const TagPoint> tags) {
  std::map<std::tuple<long, long, long>, size_t> known;
  std::vector<TagFamily> families;
  for (size_t i = 0; i < tags.size(); ++i) {
    const auto& n = tags[i].normal;
    const std::tuple key(std::lround(n[0] / normal_step), std::lround(n[1] / normal_step),
                         std::lround(n[2] / normal_step));
    const auto [at, fresh] = known.try_emplace(key, families.size());
    if (fresh) families.push_back({vector_of(n), {}});
    families[at->second].tags.push_back(i);
  }
  std::erase_if(families, [](const TagFamily& family) { return family.tags.size() < least_family; });
  return families;
}

/// The family's points cut into images along m, or nothing unless nearly all lie in few thin planes.
std::optional<std::vector<TagSlice>> images_along(const Vector3d& m, std::span<const TagPoint> tags,
                                                  size_t number, const TagFamily& family) {
  std::vector<std::pair<double, size_t>> places;
  for (const size_t i : family.tags)
    places.emplace_back(m.dot(vector_of(tags[i].x_mm)), i);
  std::sort(places.begin(), places.end());
  std::vector<TagSlice> slices;
  size_t inside = 0;
  for (size_t first = 0; first < places.size();) {
    size_t end = first + 1;
    while (end < places.size() && places[end].first - places[end - 1].first < image_gap_mm)
      ++end;
    if (places[end - 1].first - places[first].first > image_thickness_mm) return {};
    TagSlice slice{number, m, 0.5 * (places[first].first + places[end - 1].first), {}};
    for (size_t i = first; i < end; ++i)
      slice.tags.push_back(places[i].second);
    if (slice.tags.size() >= least_family) {
      inside += slice.tags.size();
      slices.push_back(std::move(slice));
    }
    first = end;
  }
  if (slices.size() > most_images ||
      static_cast<double>(inside) < least_share * static_cast<double>(family.tags.size()))
    return {};
  return slices;
}

}  // namespace

TagGroups group_tags(std::span<const TagPoint> tags) {
  TagGroups groups{families_of(tags), {}};
  for (size_t f = 0; f < groups.families.size(); ++f) {
    const TagFamily& family = groups.families[f];
    std::optional<std::vector<TagSlice>> best;
    for (size_t g = 0; g < std::min(groups.families.size(), most_partners); ++g) {
      Vector3d m = family.normal.cross(groups.families[g].normal);
      if (m.norm() < 0.1) continue;
      m.normalize();
      Eigen::Index largest = 0;
      m.cwiseAbs().maxCoeff(&largest);
      if (m[largest] < 0) m = -m;
      auto images = images_along(m, tags, f, family);
      if (images && (!best || images->size() < best->size())) best = std::move(images);
    }
    if (!best) best = std::vector<TagSlice>{{f, Vector3d::Zero(), 0.0, family.tags}};
    for (TagSlice& slice : *best)
      groups.slices.push_back(std::move(slice));
  }
  return groups;
}

std::string direction_words(const Eigen::Vector3d& direction) {
  const auto rounded = [](double v) { return std::abs(v) < 0.005 ? 0.0 : v; };
  return fmt::format("({:.2g}, {:.2g}, {:.2g})", rounded(direction[0]), rounded(direction[1]),
                     rounded(direction[2]));
}

std::string slice_words(const TagGroups& groups, const TagSlice& slice) {
  const std::string tags = "tags along " + direction_words(groups.families[slice.family].normal);
  if (slice.image_normal.isZero()) return tags;
  return fmt::format("{} in the image at {:.1f} mm along {}", tags,
                     std::abs(slice.position_mm) < 0.05 ? 0.0 : slice.position_mm,
                     direction_words(slice.image_normal));
}

}  // namespace diastole
