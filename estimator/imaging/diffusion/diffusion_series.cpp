#include "estimator/imaging/diffusion/diffusion_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "estimator/imaging/diffusion/nifti_series.hpp"
#include "estimator/imaging/diffusion/tensor_fit.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

/// Weightings of one volume are written alike in all slices but for rounding (Siemens rounds b-matrices to 1 s/mm²); neighbours in any
/// scheme of up to a thousand directions differ by more.
constexpr double same_weighting_share = 0.005;

bool same_weighting(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return (a - b).norm() <= same_weighting_share * std::max({a.norm(), b.norm(), 200.0});
}

std::vector<const ImageSeries*> chosen_series(const ImageFolder& folder, const DiffusionRequest& request) {
  std::vector<const ImageSeries*> found;
  for (const ImageSeries& series : folder.series) {
    if (series.kind == SeriesKind::diffusion && (!request.series || series.number == *request.series))
      found.push_back(&series);
  }
  const std::string name = folder.folder.string();
  if (found.empty() && request.series)
    throw InputError({name, fmt::format("--series {}", *request.series),
                      "is no diffusion series of this folder", "`diastole images` lists them."});
  if (found.empty())
    throw InputError(
        {name, "(0018,9087), (0018,9601)",
         "holds no diffusion series: no header has a b value above 0 or a b-matrix",
         "Export the original diffusion-weighted images with their headers; anonymising tools may "
         "have removed private tags. As NIfTI, put .bval and .bvec beside the images."});
  for (const ImageSeries* series : found) {
    const bool alike =
        series->slices.size() == found[0]->slices.size() &&
        std::equal(series->slices.begin(), series->slices.end(), found[0]->slices.begin(),
                   [](const SliceImages& a, const SliceImages& b) { return same_place(a.plane, b.plane); });
    if (alike) continue;
    throw InputError({name, fmt::format("series {} and {}", found[0]->number, series->number),
                      "are diffusion series of different slices",
                      fmt::format("Choose one, for example --series {}.", found[0]->number)});
  }
  return found;
}

class Assembler {
 public:
  Assembler(const ImageFolder& folder, DiffusionSeries& into) : folder_(folder), into_(into) {}

  void add(const ImageSeries& series) {
    for (size_t slice = 0; slice < series.slices.size(); ++slice) {
      std::vector<size_t> images = series.slices[slice].images;
      std::stable_sort(images.begin(), images.end(), [&](size_t a, size_t b) { return order(a) < order(b); });
      for (const size_t image : images)
        add(image, slice);
    }
  }

  void finish() {
    if (unknown_ > 0)
      into_.findings.push_back(
          {Severity::note, "no-direction",
           fmt::format("{} weighted images have no direction, as trace images have none", unknown_),
           first_unknown_, static_cast<double>(unknown_), "images", "They are left out."});
    std::vector<size_t> chosen;
    for (const auto& row : places_)
      for (const auto& image : row)
        if (image) chosen.push_back(*image);
    std::vector<Image> pixels = folder_.pixels(chosen);
    size_t next = 0;
    for (size_t v = 0; v < places_.size(); ++v) {
      for (size_t slice = 0; slice < places_[v].size(); ++slice) {
        if (places_[v][slice]) into_.volumes[v].images[slice] = std::move(pixels[next++]);
      }
    }
    report_holes();
  }

 private:
  [[nodiscard]] std::pair<int, int> order(size_t image) const {
    const ImageHeader& header = folder_.images[image].header;
    return {header.instance, header.frame};
  }

  void add(size_t image, size_t slice) {
    const auto& diffusion = folder_.images[image].header.diffusion;
    const auto weighting = diffusion ? diffusion->weighting() : std::nullopt;
    if (!weighting) {
      if (unknown_++ == 0) first_unknown_ = folder_.file_name(image);
      return;
    }
    into_.encoding = diffusion->b_matrix ? "b-matrix" : "b value and direction";
    // The first volume of this weighting that has no image of this slice yet.
    int repetition = 0;
    for (size_t v = 0; v < places_.size(); ++v) {
      if (!same_weighting(into_.volumes[v].b_matrix, *weighting)) continue;
      if (!places_[v][slice]) {
        places_[v][slice] = image;
        return;
      }
      ++repetition;
    }
    into_.volumes.push_back({*weighting, repetition, std::vector<std::optional<Image>>(into_.slices.size())});
    places_.emplace_back(into_.slices.size());
    places_.back()[slice] = image;
  }

  void report_holes() {
    for (const DiffusionVolume& volume : into_.volumes) {
      for (size_t slice = 0; slice < volume.images.size(); ++slice) {
        if (volume.images[slice]) continue;
        into_.findings.push_back({Severity::warning, "image-missing",
                                  fmt::format("the image of {} is missing in slice {} of {}", volume.name(),
                                              slice + 1, volume.images.size()),
                                  fmt::format("slice {}, {}", slice + 1, volume.name()),
                                  static_cast<double>(slice + 1), "slice",
                                  "The slice's tensors are fitted without it. Export the series again if the "
                                  "scanner still has it."});
      }
    }
  }

  const ImageFolder& folder_;
  DiffusionSeries& into_;
  std::vector<std::vector<std::optional<size_t>>> places_;  ///< [volume][slice] into ImageFolder::images
  size_t unknown_ = 0;
  std::string first_unknown_;
};

DiffusionSeries of_dicom(const std::filesystem::path& path, const DiffusionRequest& request,
                         const Progress& progress) {
  const ImageFolder folder = read_image_folder(path, progress);
  // That there is no diffusion at all says more than what else is wrong.
  if (std::any_of(folder.series.begin(), folder.series.end(),
                  [](const ImageSeries& series) { return series.kind == SeriesKind::diffusion; }))
    require_sound(folder);
  const std::vector<const ImageSeries*> chosen = chosen_series(folder, request);
  DiffusionSeries series;
  series.findings = folder.problems;
  for (const ImageSeries* one : chosen)
    series.name += fmt::format("{}{}", series.name.empty() ? "series " : ", ", one->number);
  for (const SliceImages& slice : chosen[0]->slices)
    series.slices.push_back(slice.plane);
  Assembler assembler(folder, series);
  for (const ImageSeries* one : chosen)
    assembler.add(*one);
  assembler.finish();
  return series;
}

/// A thickness that no header gives is the step from slice to slice.
void settle_geometry(DiffusionSeries& series) {
  const SlicePlane& plane = series.slices.front();
  series.image_axes.col(0) = plane.along_row;
  series.image_axes.col(1) = plane.along_column;
  series.image_axes.col(2) = plane.normal();
  series.thickness_mm = plane.thickness_mm;
  if (series.thickness_mm == 0 && series.slices.size() > 1)
    series.thickness_mm = std::abs((series.slices[1].origin_mm - plane.origin_mm).dot(plane.normal()));
}

}  // namespace

Eigen::Vector3d DiffusionVolume::direction() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(b_matrix);
  Eigen::Vector3d axis = eigen.eigenvectors().col(2);
  // One of two signs, always the same: the largest part is positive.
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  return axis[largest] < 0 ? Eigen::Vector3d(-axis) : axis;
}

std::string DiffusionVolume::name() const {
  if (b_s_mm2() < DiffusionSeries::unweighted_s_mm2)
    return repetition > 0 ? fmt::format("b 0, repetition {}", repetition + 1) : "b 0";
  const Eigen::Vector3d g = direction();
  return fmt::format("b {:.0f} along ({:.2f}, {:.2f}, {:.2f}){}", b_s_mm2(), g.x(), g.y(), g.z(),
                     repetition > 0 ? fmt::format(", repetition {}", repetition + 1) : "");
}

std::vector<double> DiffusionSeries::b_values() const {
  std::set<double> values;
  for (const DiffusionVolume& volume : volumes)
    values.insert(volume.b_s_mm2() < unweighted_s_mm2 ? 0.0 : 10.0 * std::round(0.1 * volume.b_s_mm2()));
  return {values.begin(), values.end()};
}

std::vector<Eigen::Vector3d> DiffusionSeries::directions() const {
  constexpr double same_cosine = 0.9998;  // one degree
  std::vector<Eigen::Vector3d> all;
  for (const DiffusionVolume& volume : volumes) {
    if (volume.b_s_mm2() < unweighted_s_mm2) continue;
    const Eigen::Vector3d g = volume.direction();
    const bool known = std::any_of(all.begin(), all.end(), [&](const Eigen::Vector3d& other) {
      return std::abs(other.dot(g)) > same_cosine;
    });
    if (!known) all.push_back(g);
  }
  return all;
}

DiffusionSeries read_diffusion(const std::filesystem::path& folder, const DiffusionRequest& request,
                               const Progress& progress) {
  const auto nifti = nifti_files(folder);
  DiffusionSeries series = nifti ? read_nifti(*nifti) : of_dicom(folder, request, progress);
  settle_geometry(series);
  require_tensor_scheme(series, folder);
  return series;
}

void require_tensor_scheme(const DiffusionSeries& series, const std::filesystem::path& folder) {
  for (size_t slice = 0; slice < series.slices.size(); ++slice) {
    std::vector<size_t> there;
    for (size_t v = 0; v < series.volumes.size(); ++v)
      if (series.volumes[v].images[slice]) there.push_back(v);
    const int rank = design_rank(tensor_design(series, there));
    if (rank == tensor_unknowns) continue;
    throw InputError(
        {folder.string(), fmt::format("{}, slice {}", series.name, slice + 1),
         fmt::format("its {} images with {} directions determine {} of the {} numbers of a tensor and S0",
                     there.size(), series.directions().size(), rank, tensor_unknowns),
         "A tensor needs an image with b = 0 (or a second b value) and six directions or more that do not "
         "lie on one cone or plane: is one missing in the export?"});
  }
}

}  // namespace diastole::imaging
