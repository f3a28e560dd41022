#include "estimator/imaging/series/image_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <set>

#include "estimator/imaging/series/phase_order.hpp"
#include "estimator/io/fingerprint.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {
namespace {

namespace fs = std::filesystem;

/// A magnitude lies on one side of its lowest value; a velocity's noise fills both sides of zero alike, unless the image is
/// mostly still tissue, whose values are near zero.
constexpr double one_sided = 0.5;

void report_fault(const FileFault& fault, const fs::path& file, const std::string& name,
                  std::vector<Finding>& problems) {
  const std::string place = fault.place.empty() ? "" : fault.place + ": ";
  switch (fault.kind) {
    case FileFault::Kind::foreign:
      if (claims_to_be_dicom(file))
        problems.push_back(
            {Severity::error, "foreign-file", place + fault.problem, name, 1, "", fault.remedy});
      return;
    case FileFault::Kind::not_mr:
      problems.push_back({Severity::error, "not-mr", place + fault.problem, name, 1, "", fault.remedy});
      return;
    case FileFault::Kind::truncated:
      problems.push_back({Severity::error, "truncated", place + fault.problem, name, 1, "", fault.remedy});
      return;
    case FileFault::Kind::unusable:
      problems.push_back({Severity::error, "unusable", place + fault.problem, name, 1, "", fault.remedy});
  }
}

/// Both halves of the values on either side of zero, of like extent.
bool is_signed_about_zero(const Image& image) {
  std::vector<float> values(image.data(), image.data() + image.size());
  const auto low = static_cast<double>(signal::quantile(values, 0.02));
  const auto high = static_cast<double>(signal::quantile(std::move(values), 0.98));
  return low < 0 && high > 0 && std::abs(low + high) < one_sided * (high - low);
}

/// Whether the phases of a slice differ by no more than noise: motion makes phases that are far apart differ by more than neighbours do.
bool is_still(const std::vector<Image>& phases) {
  constexpr float excess =
      1.2F;  // of a mean square over thousands of pixels, whose own spread is a few hundredths
  if (phases.size() < 3) return false;
  const auto square = [&](size_t a, size_t b) { return (phases[a] - phases[b]).square().mean(); };
  float neighbours = 0, most = 0;
  for (size_t k = 1; k < phases.size(); ++k) {
    neighbours += square(k, k - 1) / static_cast<float>(phases.size() - 1);
    most = std::max(most, square(k, 0));
  }
  return most <= excess * neighbours;
}

/// In the last phase over the first: tags fade, and motion at the first phase blurs them by less than this.
constexpr double most_growth = 1.25;

/// Images of one series that may be one stack: what they are (magnitude or phase) and how they lie.
struct Stack {
  std::string uid;
  Component component;
  std::vector<size_t> images;
};

class Sorter {
 public:
  explicit Sorter(ImageFolder& folder) : folder_(folder) {}

  void sort() {
    report_equal_instances();
    settle_components();
    for (Stack& stack : stacks())
      add_series(stack);
    std::stable_sort(folder_.series.begin(), folder_.series.end(),
                     [](const ImageSeries& a, const ImageSeries& b) { return a.number < b.number; });
    leave_out_copies();
    compare_phases();
    check_worth();
  }

 private:
  const ImageHeader& header(size_t image) const { return folder_.images[image].header; }

  /// As ImageFolder's; a file that cannot be decoded is reported, and blank images stand in its place. From several threads.
  std::vector<Image> pixels(const std::vector<size_t>& images) {
    try {
      return folder_.pixels(images);
    } catch (const InputError&) {
      std::vector<Image> each;
      for (const size_t image : images)
        each.push_back(pixels(image));
      return each;
    }
  }
  Image pixels(size_t image) {
    try {
      return folder_.pixels({image})[0];
    } catch (const InputError& error) {
      const std::scoped_lock lock(damaging_);
      if (damaged_.insert(folder_.images[image].file).second)
        complain(Severity::error, "damaged-pixels",
                 fmt::format("{}: {}", error.fault().place, error.fault().problem), image, 1, "images",
                 error.fault().remedy);
      return Image::Zero(header(image).plane.rows, header(image).plane.columns);
    }
  }

  void complain(Severity severity, std::string id, std::string what, size_t image, double number,
                std::string unit, std::string remedy) {
    folder_.problems.push_back({severity, std::move(id), std::move(what), folder_.file_name(image), number,
                                std::move(unit), std::move(remedy)});
  }

  /// An instance is one image for ever: what bears the identity of another was altered, or made by careless software.
  void report_equal_instances() {
    std::map<std::pair<std::string, int>, size_t> first;
    std::optional<std::pair<size_t, size_t>> equal;
    double count = 0;
    for (size_t image = 0; image < folder_.images.size(); ++image) {
      if (header(image).instance_uid.empty()) continue;
      const auto [one, is_new] = first.try_emplace({header(image).instance_uid, header(image).frame}, image);
      if (is_new || folder_.images[one->second].file == folder_.images[image].file) continue;
      const ImageHeader& here = header(image);
      const ImageHeader& there = header(one->second);
      const bool is_copy = here.trigger_ms == there.trigger_ms && same_place(here.plane, there.plane);
      if (is_copy) continue;  // reported with slice or series
      if (!equal) equal = {image, one->second};
      count += 1;
    }
    if (!equal) return;
    const auto [image, other] = *equal;
    complain(Severity::warning, "instance-twice",
             fmt::format("the SOP Instance UID (0008,0018) is that of {}, which is another image",
                         folder_.file_name(other)),
             image, count, "images",
             "Both are read as they are. Was one of them altered? Export the series again if you can.");
  }

  /// Where a series holds several kinds of picture and its headers do not say which is which, the pixels do.
  void settle_components() {
    std::map<std::string, std::vector<size_t>> unstated;
    for (size_t image = 0; image < folder_.images.size(); ++image) {
      if (header(image).component == Component::unstated) unstated[header(image).series_uid].push_back(image);
    }
    for (const auto& series : unstated) {
      const std::vector<size_t>& images = series.second;
      std::vector<Component> found(images.size());
      constexpr size_t together = 64;  // a file of many frames is opened once for so many
      parallel_for((images.size() + together - 1) / together, machine_threads(), [&](size_t part) {
        const size_t first = part * together, last = std::min(first + together, images.size());
        const std::vector<Image> read = pixels({images.begin() + static_cast<std::ptrdiff_t>(first),
                                                images.begin() + static_cast<std::ptrdiff_t>(last)});
        for (size_t i = first; i < last; ++i)
          found[i] = is_signed_about_zero(read[i - first]) ? Component::phase : Component::magnitude;
      });
      for (size_t i = 0; i < images.size(); ++i)
        folder_.images[images[i]].header.component = found[i];
    }
  }

  /// By series, component and orientation, in the order of their first images.
  std::vector<Stack> stacks() {
    std::vector<Stack> all;
    for (size_t image = 0; image < folder_.images.size(); ++image) {
      const auto fits = std::find_if(all.begin(), all.end(), [&](const Stack& stack) {
        const ImageHeader& first = header(stack.images[0]);
        return stack.uid == header(image).series_uid && stack.component == header(image).component &&
               parallel_alike(first.plane, header(image).plane);
      });
      if (fits != all.end()) {
        fits->images.push_back(image);
      } else {
        all.push_back({header(image).series_uid, header(image).component, {image}});
      }
    }
    report_mixed(all);
    return all;
  }

  [[nodiscard]] double images_a_slice(const Stack& stack) const {
    std::vector<SlicePlane> places;
    for (const size_t image : stack.images) {
      const SlicePlane& plane = header(image).plane;
      if (std::ranges::none_of(places, [&](const SlicePlane& one) { return same_place(one, plane); }))
        places.push_back(plane);
    }
    return static_cast<double>(stack.images.size()) / static_cast<double>(places.size());
  }

  /// A series may hold several orientations, as a localiser does, or a cine along and across the axis. Images that lie otherwise than
  /// a cine's, with fewer than half of its phases, are no slice of their own: the protocol changed, or files of two scans were mixed.
  void report_mixed(std::vector<Stack>& all) {
    std::map<const Stack*, double> phases;
    for (const Stack& stack : all)
      phases[&stack] = images_a_slice(stack);
    for (const Stack& few : all) {
      const auto many = std::find_if(all.begin(), all.end(), [&](const Stack& other) {
        return other.uid == few.uid && other.component == few.component &&
               phases.at(&other) > 2 * phases.at(&few);
      });
      if (many == all.end()) continue;
      const SlicePlane& here = header(few.images[0]).plane;
      const SlicePlane& there = header(many->images[0]).plane;
      complain(Severity::error, "mixed-geometry",
               fmt::format("another geometry than the rest of its series: {} x {} pixels of {:.4g} x {:.4g} "
                           "mm, {}, beside {} x "
                           "{} of {:.4g} x {:.4g} mm, {}",
                           here.rows, here.columns, here.row_spacing_mm, here.column_spacing_mm,
                           orientation_in_words(here), there.rows, there.columns, there.row_spacing_mm,
                           there.column_spacing_mm, orientation_in_words(there)),
               few.images[0], static_cast<double>(few.images.size()), "images",
               "Export the series again, or move these images out of the folder.");
    }
  }

  std::vector<SliceImages> slices_of(const Stack& stack) const {
    std::vector<SliceImages> slices;
    for (const size_t image : stack.images) {
      const auto fits = std::find_if(slices.begin(), slices.end(), [&](const SliceImages& slice) {
        return same_place(slice.plane, header(image).plane);
      });
      if (fits != slices.end()) {
        fits->images.push_back(image);
      } else {
        slices.push_back({header(image).plane, {image}});
      }
    }
    const Eigen::Vector3d normal = slices.front().plane.normal();
    std::sort(slices.begin(), slices.end(), [&](const SliceImages& a, const SliceImages& b) {
      return a.plane.origin_mm.dot(normal) < b.plane.origin_mm.dot(normal);
    });
    for (SliceImages& slice : slices) {
      std::stable_sort(slice.images.begin(), slice.images.end(), [&](size_t a, size_t b) {
        return std::pair(header(a).trigger_ms.value_or(0), header(a).instance) <
               std::pair(header(b).trigger_ms.value_or(0), header(b).instance);
      });
    }
    return slices;
  }

  void add_series(const Stack& stack) {
    ImageSeries series;
    const ImageHeader& first = header(stack.images[0]);
    series.number = first.series_number;
    series.vendor = first.vendor;
    series.interval_ms = first.interval_ms;
    series.velocity = first.velocity;
    series.slices = slices_of(stack);
    std::set<size_t> files;
    std::set<double> b_values;
    for (const size_t image : stack.images) {
      files.insert(folder_.images[image].file);
      if (header(image).diffusion) b_values.insert(header(image).diffusion->b_s_mm2);
    }
    series.files.assign(files.begin(), files.end());
    series.b_s_mm2.assign(b_values.begin(), b_values.end());
    const bool is_diffusion = b_values.size() > 1 || (b_values.size() == 1 && *b_values.begin() > 0);
    if (is_diffusion) {
      series.kind = SeriesKind::diffusion;
      series.reason = fmt::format("the headers give {} b values, up to {:.0f} s/mm\u00b2", b_values.size(),
                                  *b_values.rbegin());
    } else {
      number_phases(series);
      find_kind(series);
    }
    folder_.series.push_back(std::move(series));
  }

  /// Phases in time; what has none, or one twice, cannot be followed.
  void number_phases(ImageSeries& series) {
    std::vector<std::vector<double>> times_ms;
    for (const SliceImages& slice : series.slices) {
      times_ms.emplace_back();
      for (const size_t image : slice.images) {
        if (header(image).trigger_ms) {
          times_ms.back().push_back(*header(image).trigger_ms);
        } else if (slice.images.size() > 1) {
          complain(
              Severity::error, "no-trigger-time",
              fmt::format("TriggerTime (0018,1060), or (0020,9153) of a file of many frames, is absent or no "
                          "time of a cycle: the {} images of this slice cannot be put in order of time",
                          slice.images.size()),
              image, static_cast<double>(slice.images.size()), "images",
              "Export the original gated images; anonymising tools may have removed the time.");
          return;
        }
      }
      if (!times_differ(slice, times_ms.back())) return;
    }
    series.phases = phase_times(times_ms);
    std::vector<Copy> copies;
    for (SliceImages& slice : series.slices)
      check_slice(series, slice, copies);
    report_copies(copies);
    check_ends_of_cycle(series);
    check_spacing_of_slices(series);
  }

  /// Whether the trigger times of different images are different ones.
  bool times_differ(const SliceImages& slice, const std::vector<double>& times_ms) {
    if (times_ms.size() < 3) return true;  // two may be copies
    const auto [first, last] = std::minmax_element(times_ms.begin(), times_ms.end());
    if (*last - *first > trigger_resolution_ms * static_cast<double>(times_ms.size() - 1)) return true;
    if (same_pixels(slice.images.front(), slice.images.back())) return true;
    complain(Severity::error, "trigger-times-alike",
             fmt::format("TriggerTime (0018,1060) goes from {:g} to {:g} ms in the {} images of this slice: "
                         "they cannot be put in order of time",
                         *first, *last, times_ms.size()),
             slice.images.front(), *last - *first, "ms",
             "Export the original gated images. Times in seconds have to be made milliseconds.");
    return false;
  }

  /// What lacks at the ends leaves no gap: the header may say, or the first trigger time.
  void check_ends_of_cycle(const ImageSeries& series) {
    const size_t image = series.slices.front().images.front();
    const std::vector<double>& times_ms = series.phases.times_ms;
    if (times_ms.size() < 2) return;
    const auto announced = header(image).phases_announced;
    if (announced && *announced > static_cast<int>(times_ms.size()))
      complain(Severity::warning, "phases-announced",
               fmt::format("{} phases are here, and (0018,1090) announces {}", times_ms.size(), *announced),
               image, static_cast<double>(*announced) - static_cast<double>(times_ms.size()), "phases",
               "Frames are numbered from the first phase that is here. Export the series again if some are "
               "lost.");
    const double step_ms = (times_ms.back() - times_ms.front()) / static_cast<double>(times_ms.size() - 1);
    constexpr double late = 1.5;  // steps after the trigger
    // Series of one protocol are alike in this.
    if (times_ms.front() > late * step_ms &&
        late_.insert(std::lround(times_ms.front() / trigger_resolution_ms)).second)
      complain(Severity::warning, "first-phase-late",
               fmt::format("the first phase is at {:.0f} ms, {:.1f} steps after the trigger",
                           times_ms.front(), times_ms.front() / step_ms),
               image, times_ms.front(), "ms",
               "Frames are numbered from it. Export the series again if phases before it are lost.");
    if (times_ms.front() < 0)
      complain(
          Severity::warning, "trigger-time-negative",
          fmt::format("TriggerTime (0018,1060) begins at {:.0f} ms, before the trigger", times_ms.front()),
          image, times_ms.front(), "ms", "Is this the time since the trigger?");
  }

  struct Copy {
    size_t image, of;
  };
  /// A folder that was copied into itself is one thing to report.
  void report_copies(const std::vector<Copy>& copies) {
    if (copies.empty()) return;
    const std::string others =
        copies.size() > 1 ? fmt::format(", and so are {} more of this series of others", copies.size() - 1)
                          : "";
    complain(Severity::warning, "copy",
             fmt::format("a copy of {}{}", folder_.file_name(copies.front().of), others),
             copies.front().image, static_cast<double>(copies.size()), "images",
             "Nothing is lost: one of each two is used.");
  }

  void check_slice(const ImageSeries& series, SliceImages& slice, std::vector<Copy>& copies) {
    std::vector<int> found(series.phases.times_ms.size());
    std::vector<size_t> kept;
    for (const size_t image : slice.images) {
      const auto phase =
          header(image).trigger_ms ? series.phases.index_of(*header(image).trigger_ms) : std::nullopt;
      const bool twice = phase && found[*phase]++ > 0;
      if (!twice) {
        kept.push_back(image);
      } else if (same_pixels(kept.back(), image)) {
        copies.push_back({image, kept.back()});
      } else {
        kept.push_back(image);
        complain(Severity::error, "slice-twice",
                 fmt::format("phase {} at {:.0f} ms of this slice is there twice, also as {}", *phase + 1,
                             *header(image).trigger_ms, folder_.file_name(kept[kept.size() - 2])),
                 image, *header(image).trigger_ms, "ms",
                 "Move the repetition that does not count out of the folder.");
        break;
      }
    }
    slice.images = kept;
    std::string missing;
    for (size_t phase = 0; phase < found.size(); ++phase) {
      if (found[phase] == 0) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", phase + 1);
    }
    if (!missing.empty())
      complain(Severity::warning, "phase-missing",
               fmt::format("phase {} of {} is missing in this slice", missing, found.size()), slice.images[0],
               static_cast<double>(std::count(found.begin(), found.end(), 0)), "phases",
               "What is measured goes across the gap, or without it. Export the series again if the scanner "
               "still has "
               "it.");
  }

  bool same_pixels(size_t a, size_t b) { return (pixels(a) == pixels(b)).all(); }

  /// In a stack of equal steps, a step of twice or three times the size is a slice that was lost.
  void check_spacing_of_slices(const ImageSeries& series) {
    std::vector<double> steps_mm;
    for (size_t i = 1; i < series.slices.size(); ++i)
      steps_mm.push_back((series.slices[i].plane.origin_mm - series.slices[i - 1].plane.origin_mm)
                             .dot(series.plane().normal()));
    if (steps_mm.size() < 2) return;
    const double least = *std::min_element(steps_mm.begin(), steps_mm.end());
    for (size_t i = 0; i < steps_mm.size(); ++i) {
      if (steps_mm[i] < 1.5 * least) continue;
      complain(Severity::warning, "slice-missing",
               fmt::format("the next slice is {:.1f} mm away, others {:.1f} mm: slices are missing",
                           steps_mm[i], least),
               series.slices[i].images[0], steps_mm[i], "mm",
               "Export the series again if they were acquired.");
    }
  }

  void find_kind(ImageSeries& series) {
    const SliceImages& middle = series.slices[series.slices.size() / 2];
    const Image first = pixels(middle.images.front());
    if (is_signed_about_zero(first)) {
      series.kind = SeriesKind::velocity;
      series.reason =
          fmt::format("values lie on both sides of zero, from {:.4g} to {:.4g}{}",
                      static_cast<double>(first.minCoeff()), static_cast<double>(first.maxCoeff()),
                      series.velocity ? fmt::format("; velocity encoding {:.4g} cm/s by {}",
                                                    series.velocity->venc_cm_s, series.velocity->source)
                                      : "");
      return;
    }
    for (SliceImages& slice : series.slices)
      slice.tags = find_tag_waves(pixels(slice.images.front()), slice.plane);
    const bool several = middle.images.size() > 1;
    const SliceImages& clearest = series.clearest();
    if (several && !clearest.tags.empty()) {
      series.kind = SeriesKind::tagged_cine;
      const TagWave& tag = clearest.tags[0];
      const Image last = pixels(clearest.images.back());
      for (const SliceImages& slice : series.slices) {
        if (slice.tags.empty())
          complain(Severity::warning, "slice-without-tags",
                   "no tags are seen in this slice of a tagged series", slice.images.front(), 1, "slices",
                   "Nothing is tracked in it. Does it lie beyond the specimen's end?");
      }
      for (SliceImages& slice : series.slices)
        check_order(slice);
      if (const double left = modulation_at(last, clearest.plane, tag.per_mm);
          left > most_growth * tag.modulation)
        complain(
            Severity::error, "tags-grow",
            fmt::format("the tags grow from {:.0f} % in the first phase to {:.0f} % in this one, and tags "
                        "fade: the order of time is "
                        "wrong",
                        100 * tag.modulation, 100 * left),
            clearest.images.back(), 100 * left, "%",
            "Are the trigger times (0018,1060) counted from the tags, or backwards from the next trigger?");
      series.reason = fmt::format(
          "the first phase's spectrum has {} of {:.2f} mm, {:.0f} times its surroundings; modulation {:.0f} "
          "%, {:.0f} % in the last phase",
          clearest.tags.size() == 1 ? "a line" : "a grid of lines", tag.spacing_mm(), tag.prominence,
          100 * tag.modulation, 100 * modulation_at(last, clearest.plane, tag.per_mm));
      return;
    }
    if (several) check_other_phases(middle);
    series.kind = several ? SeriesKind::cine : SeriesKind::anatomy;
    series.reason = several ? "several phases, and no line of tags in the spectrum" : "one image a slice";
    if (several && header(middle.images.front()).says_tagged)
      complain(Severity::warning, "tags-not-seen",
               "the header says tagged (0018,9028), the image shows no tags", middle.images.front(), 1, "",
               "Look at the first phase: were the tags switched on?");
  }

  /// Tags are laid before the first phase and fade: none there and some later is a first image that is spoilt, or a wrong order.
  void check_other_phases(const SliceImages& slice) {
    for (const size_t image : {slice.images[1], slice.images.back()}) {
      if (find_tag_waves(pixels(image), slice.plane).empty()) continue;
      complain(Severity::warning, "tags-begin-late",
               fmt::format(
                   "tags are seen in this image at {:.0f} ms, and none in the first at {:.0f} ms: taken for "
                   "a cine without tags",
                   header(image).trigger_ms.value_or(0), header(slice.images.front()).trigger_ms.value_or(0)),
               image, header(image).trigger_ms.value_or(0), "ms",
               "Look at the first phase, and whether the trigger times (0018,1060) are right. A spoilt first "
               "phase may be moved out of the folder.");
      return;
    }
  }

  /// What lies between its neighbours by no motion is left out: tracking goes across the gap.
  void check_order(SliceImages& slice) {
    if (slice.images.size() > most_phases_compared) return;
    const std::vector<Image> phases = pixels(slice.images);
    if (phases.size() > 2 && !damaged_.contains(folder_.images[slice.images.front()].file) &&
        std::ranges::all_of(phases, [&](const Image& one) { return (one == phases[0]).all(); })) {
      complain(Severity::error, "phases-copied",
               fmt::format("all {} images of this slice have the same pixels", phases.size()),
               slice.images.front(), static_cast<double>(phases.size()), "images",
               "Export the original images: no two that were measured are alike to the last bit.");
      return;
    }
    const PhaseOrder order = order_of_phases(phases);
    const auto time_ms = [&](size_t phase) { return header(slice.images[phase]).trigger_ms.value_or(0); };
    for (const PhaseOrder::LeftOut& out : order.left_out) {
      const size_t image = slice.images[out.phase];
      if (damaged_.contains(folder_.images[image].file)) continue;  // already reported
      complain(Severity::warning, out.same_as ? "phase-copied" : "phase-unlike",
               out.same_as ? fmt::format("the image at {:.0f} ms has the pixels of {}", time_ms(out.phase),
                                         folder_.file_name(slice.images[*out.same_as]))
               : out.phase + 1 == slice.images.size()
                   ? fmt::format(
                         "the last image, at {:.0f} ms, is unlike all others, {:.1f} times as far from any "
                         "of them as two in succession are from each other",
                         time_ms(out.phase), out.times_farther)
                   : fmt::format("the image at {:.0f} ms is unlike those before and after it, {:.1f} "
                                 "times as far from them as they "
                                 "are from each other",
                                 time_ms(out.phase), out.times_farther),
               image, time_ms(out.phase), "ms",
               "It is left out, and tracking goes across the gap. Is it spoilt, or is its trigger time "
               "(0018,1060) another image's?");
    }
    if (const auto& two = order.exchange)
      complain(Severity::error, "phases-exchanged",
               fmt::format("the images at {:.0f} and {:.0f} ms seem to have each other's time: from phase to "
                           "phase, images would differ by "
                           "{:.0f} % less if they were exchanged",
                           time_ms(two->first), time_ms(two->second), 100 * two->saved),
               slice.images[two->first], time_ms(two->first), "ms",
               "Compare the trigger times (0018,1060) with the order in which the images were taken.");
    std::vector<size_t> kept;
    for (const size_t phase : order.kept)
      kept.push_back(slice.images[phase]);
    slice.images = std::move(kept);
  }

  /// A tagged series whose images are another's once more would count twice.
  void leave_out_copies() {
    std::vector<ImageSeries> kept;
    std::map<std::string, size_t> of_first_image;  // the series that was kept
    for (ImageSeries& series : folder_.series) {
      if (series.kind == SeriesKind::tagged_cine) {
        const size_t image = series.slices.front().images.front();
        const Image first = pixels(image);
        const std::string print = fingerprint_of(
            {reinterpret_cast<const char*>(first.data()), sizeof(float) * static_cast<size_t>(first.size())});
        const auto [before, is_new] = of_first_image.try_emplace(print, kept.size());
        if (!is_new && are_same(series, kept[before->second])) {
          const ImageSeries& other = kept[before->second];
          complain(Severity::warning, "series-twice",
                   fmt::format("its series holds the images of series {} once more, as of {}", other.number,
                               folder_.file_name(other.slices.front().images.front())),
                   image, static_cast<double>(series.slices.size()), "slices",
                   "Nothing is lost: one of the two is used.");
          continue;
        }
      }
      kept.push_back(std::move(series));
    }
    folder_.series = std::move(kept);
  }

  bool are_same(const ImageSeries& one, const ImageSeries& other) {
    return std::ranges::equal(one.slices, other.slices, [&](const SliceImages& a, const SliceImages& b) {
      return same_place(a.plane, b.plane) && a.images.size() == b.images.size() &&
             same_pixels(a.images.front(), b.images.front()) && same_pixels(a.images.back(), b.images.back());
    });
  }

  /// Tagged series are tracked with one numbering of the frames.
  void compare_phases() {
    const size_t together = tagged_phases(folder_).times_ms.size();
    const ImageSeries* most = nullptr;
    for (const ImageSeries& series : folder_.series)
      if (series.kind == SeriesKind::tagged_cine &&
          (most == nullptr || series.phases.times_ms.size() > most->phases.times_ms.size()))
        most = &series;
    if (most == nullptr) return;
    if (together == most->phases.times_ms.size()) {
      report_shorter(*most);
      return;
    }
    complain(Severity::warning, "phases-differ",
             fmt::format("the tagged series were taken at different times: {} phases of theirs together, and "
                         "{} in series {}",
                         together, most->phases.times_ms.size(), most->number),
             most->slices.front().images.front(), static_cast<double>(together), "frames",
             "Each has a frame of its own. Do all belong to one protocol and one specimen?");
  }

  /// A series that begins later or ends earlier than others leaves no gap of its own.
  void report_shorter(const ImageSeries& most) {
    for (const ImageSeries& series : folder_.series) {
      if (series.kind != SeriesKind::tagged_cine) continue;
      const size_t lacking = most.phases.times_ms.size() - series.phases.times_ms.size();
      if (lacking == 0) continue;
      complain(Severity::warning, "phases-fewer",
               fmt::format("its tagged series has {} phases, from {:.0f} to {:.0f} ms, and series {} has {}",
                           series.phases.times_ms.size(), series.phases.times_ms.front(),
                           series.phases.times_ms.back(), most.number, most.phases.times_ms.size()),
               series.slices.front().images.front(), static_cast<double>(lacking), "phases",
               "It is tracked as far as it goes. Export it again if some of its images are lost.");
    }
  }

  /// A folder in which nothing is encoded and nothing moves holds nothing to measure.
  void check_worth() {
    if (folder_.series.empty()) return;
    for (const ImageSeries& series : folder_.series) {
      const SliceImages& middle = series.slices[series.slices.size() / 2];
      if (series.kind != SeriesKind::cine || !is_still(pixels(middle.images))) return;
    }
    complain(Severity::error, "nothing-to-measure",
             "no tags: the spectra hold no lines of them, and nothing moves from phase to phase either",
             folder_.series[0].slices[0].images[0], static_cast<double>(folder_.series.size()), "series",
             "Export the tagged series. Were the tags switched on, and was the pump running?");
  }

  ImageFolder& folder_;
  std::mutex damaging_;
  std::set<size_t> damaged_;  // files
  std::set<long> late_;       // first times that are reported, in steps that trigger times can differ by
};

}  // namespace

std::vector<fs::path> files_below(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(
        {folder.string(), "", "is no folder", "Name the folder that holds the scanner's export."});
  std::vector<fs::path> files;
  fs::recursive_directory_iterator at(folder, error);
  for (const fs::recursive_directory_iterator end; !error && at != end; at.increment(error)) {
    std::error_code gone;
    if (at->is_regular_file(gone)) files.push_back(at->path());
  }
  if (error)
    throw InputError({folder.string(), "", fmt::format("cannot be read to its end: {}", error.message()),
                      "Give yourself the right to read the folder and those within it."});
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<Image> ImageFolder::pixels(const std::vector<size_t>& chosen) const {
  std::map<size_t, std::vector<size_t>> by_file;  // positions in `chosen`
  for (size_t i = 0; i < chosen.size(); ++i)
    by_file[images[chosen[i]].file].push_back(i);
  std::vector<Image> result(chosen.size());
  for (const auto& [file, positions] : by_file) {
    std::vector<ImageHeader> headers;
    for (const size_t i : positions)
      headers.push_back(images[chosen[i]].header);
    std::vector<Image> read = read_pixels(files[file], headers);
    for (size_t i = 0; i < positions.size(); ++i)
      result[positions[i]] = std::move(read[i]);
  }
  return result;
}

std::string ImageFolder::file_name(size_t image) const {
  return fs::relative(files[images[image].file], folder).generic_string();
}

PhaseTimes tagged_phases(const ImageFolder& folder) {
  std::vector<std::vector<double>> times_ms;
  for (const ImageSeries& series : folder.series) {
    if (series.kind != SeriesKind::tagged_cine) continue;
    times_ms.emplace_back();
    for (size_t k = 0; k < series.phases.times_ms.size(); ++k) {
      if (series.phases.present[k]) times_ms.back().push_back(series.phases.times_ms[k]);
    }
  }
  return phase_times(times_ms);
}

std::vector<double> tag_spacings_mm(const ImageFolder& folder) {
  std::vector<double> all;
  for (const ImageSeries& series : folder.series) {
    if (series.kind != SeriesKind::tagged_cine) continue;
    for (const SliceImages& slice : series.slices)
      for (const TagWave& wave : slice.tags)
        all.push_back(wave.spacing_mm());
  }
  return all;
}

bool is_tag_spacing(double seen_mm, double stated_mm) {
  return std::abs(seen_mm - stated_mm) <= 0.05 * stated_mm;
}

ImageFolder read_image_folder(const fs::path& path, const Progress& progress) {
  ImageFolder folder;
  folder.folder = path;
  folder.files = files_below(path);
  std::vector<DicomContent> contents(folder.files.size());
  std::atomic<size_t> done = 0;
  std::mutex reporting;
  parallel_for(folder.files.size(), machine_threads(), [&](size_t i) {
    contents[i] = read_headers(folder.files[i]);
    const size_t count = ++done;
    if (!progress || (count % 100 != 0 && count != contents.size())) return;
    const std::scoped_lock lock(reporting);
    progress(count, contents.size());
  });
  for (size_t file = 0; file < contents.size(); ++file) {
    const DicomContent& content = contents[file];
    if (content.fault)
      report_fault(*content.fault, folder.files[file],
                   fs::relative(folder.files[file], path).generic_string(), folder.problems);
    for (const ImageHeader& header : content.images)
      folder.images.push_back({file, header});
  }
  if (folder.images.empty() && folder.problems.empty())
    throw InputError({path.string(), "", "holds no MR images in DICOM format",
                      "Name the folder that holds the scanner's export, or export it as DICOM."});
  Sorter(folder).sort();
  return folder;
}

void require_sound(const ImageFolder& folder) {
  const auto is_error = [](const Finding& finding) { return finding.severity == Severity::error; };
  const auto first = std::find_if(folder.problems.begin(), folder.problems.end(), is_error);
  if (first == folder.problems.end()) return;
  const auto others = std::count_if(folder.problems.begin(), folder.problems.end(), is_error) - 1;
  throw InputError({(folder.folder / first->where).string(), "",
                    others == 0
                        ? first->what
                        : fmt::format("{} (and {} more: `diastole images` lists them)", first->what, others),
                    first->remedy});
}

}  // namespace diastole::imaging
