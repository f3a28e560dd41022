#include "estimator/imaging/dicom/dicom_file.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dccodec.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <span>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::imaging {
namespace {

/// A matrix of 4096 is beyond any MR image; with 16 bits such an image takes 32 MB.
constexpr int most_pixels_a_side = 4096;
/// More frames than phases times slices of any study; bounds what a header can ask to be remembered.
constexpr int most_frames = 65536;
/// No place in a magnet is further from its middle, no pixel wider, no trigger a day ago.
constexpr double furthest_mm = 1e5, widest_mm = 1e3, narrowest_mm = 1e-3, longest_ms = 8.64e7;
/// Sequences within sequences: enhanced images have four levels, and the library calls itself for each.
constexpr size_t deepest = 64;
/// RLE (PS3.5 Annex G) stores at most 128 bytes in two: no file that is smaller can hold the image that it announces.
constexpr double most_compression = 64.0;

void prepare_library() {
  static std::once_flag once;
  std::call_once(once, [] {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);  // what is wrong with a file is said by this program
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
  });
}

std::optional<std::string> text(DcmItem& item, const DcmTagKey& tag, unsigned long position = 0) {
  OFString value;
  if (item.findAndGetOFString(tag, value, position).bad() || value.empty()) return std::nullopt;
  return std::string(value.c_str());
}

/// A number of whatever representation: FD and FL, integers, or decimal text.
std::optional<double> number(DcmItem& item, const DcmTagKey& tag, unsigned long position = 0) {
  Float64 real = 0;
  Float32 single = 0;
  Sint32 integer = 0;
  Uint16 small = 0;
  std::optional<double> value;
  if (item.findAndGetFloat64(tag, real, position).good()) {
    value = real;
  } else if (item.findAndGetFloat32(tag, single, position).good()) {
    value = static_cast<double>(single);
  } else if (item.findAndGetSint32(tag, integer, position).good()) {
    value = integer;
  } else if (item.findAndGetUint16(tag, small, position).good()) {
    value = small;
  } else if (const auto written = text(item, tag, position)) {
    char* end = nullptr;
    value = std::strtod(written->c_str(), &end);
    if (end == written->c_str()) return std::nullopt;
  }
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<Eigen::Vector3d> vector3(DcmItem& item, const DcmTagKey& tag, unsigned long first = 0) {
  Eigen::Vector3d value;
  for (unsigned long i = 0; i < 3; ++i) {
    const auto part = number(item, tag, first + i);
    if (!part) return std::nullopt;
    value[static_cast<Eigen::Index>(i)] = *part;
  }
  return value;
}

/// The places where a value of one frame may stand: its own functional groups, the shared ones, the data set.
class FrameItems {
 public:
  FrameItems(DcmItem& dataset, int frame) : dataset_(dataset) {
    add_groups(dataset, DCM_PerFrameFunctionalGroupsSequence, frame);
    add_groups(dataset, DCM_SharedFunctionalGroupsSequence, 0);
  }

  /// `get(item)` of the first item that has it: in the sequence `group` of the functional groups, or in the data set.
  template <class Get>
  auto find(const DcmTagKey& group, const Get& get) const -> decltype(get(std::declval<DcmItem&>())) {
    for (DcmItem* groups : groups_) {
      DcmItem* inside = nullptr;
      if (groups->findAndGetSequenceItem(group, inside).bad() || inside == nullptr) continue;
      if (auto value = get(*inside)) return value;
    }
    return get(dataset_);
  }
  [[nodiscard]] std::optional<double> number_in(const DcmTagKey& group, const DcmTagKey& tag,
                                                unsigned long position = 0) const {
    return find(group, [&](DcmItem& item) { return number(item, tag, position); });
  }
  [[nodiscard]] DcmItem& dataset() const { return dataset_; }

 private:
  void add_groups(DcmItem& dataset, const DcmTagKey& sequence, int index) {
    DcmItem* item = nullptr;
    if (dataset.findAndGetSequenceItem(sequence, item, index).good() && item != nullptr)
      groups_.push_back(item);
  }
  DcmItem& dataset_;
  std::vector<DcmItem*> groups_;
};

std::string vendor_of(DcmItem& dataset) {
  std::string name = text(dataset, DCM_Manufacturer).value_or("");
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  if (name.starts_with("SIEMENS")) return "Siemens";
  if (name.starts_with("GE")) return "GE";
  if (name.starts_with("PHILIPS")) return "Philips";
  if (name.starts_with("CANON") || name.starts_with("TOSHIBA")) return "Canon";
  return "unknown";
}

/// ImageType's third value and what vendors append; (0008,9208) of enhanced images.
Component component_of(const FrameItems& items) {
  const auto of_text = [](const std::string& word) {
    if (word == "P" || word == "PHASE" || word == "PHASE MAP" || word == "VELOCITY") return Component::phase;
    if (word == "M" || word == "MAGNITUDE" || word == "M_FFE") return Component::magnitude;
    return Component::unstated;
  };
  const auto said = items.find(DCM_MRImageFrameTypeSequence,
                               [](DcmItem& item) { return text(item, DCM_ComplexImageComponent); });
  if (said) return of_text(*said);
  Component found = Component::unstated;
  for (unsigned long i = 2; i < 8; ++i) {
    const auto word = text(items.dataset(), DCM_ImageType, i);
    const Component stated_here = word ? of_text(*word) : Component::unstated;
    if (stated_here == Component::phase) return stated_here;
    if (stated_here != Component::unstated) found = stated_here;
  }
  return found;
}

/// Siemens writes it into the sequence's name: *fl2d1_v80in.
std::optional<double> venc_of_sequence_name(const std::string& name) {
  for (size_t at = name.find("_v"); at != std::string::npos; at = name.find("_v", at + 1)) {
    char* end = nullptr;
    const double value = std::strtod(name.c_str() + at + 2, &end);
    if (end != name.c_str() + at + 2 && value > 0 && std::isfinite(value)) return value;
  }
  return std::nullopt;
}

std::optional<VelocityEncoding> velocity_of(const FrameItems& items, const std::string& vendor) {
  const auto standard = items.find(DCM_MRVelocityEncodingSequence, [](DcmItem& item) {
    return number(item, DCM_VelocityEncodingMaximumValue);
  });
  if (standard && *standard > 0) return VelocityEncoding{*standard, "(0018,9197)"};
  DcmItem& data = items.dataset();
  if (vendor == "Siemens") {
    if (const auto venc = venc_of_sequence_name(text(data, DCM_SequenceName).value_or("")))
      return VelocityEncoding{*venc, "SequenceName"};
  }
  if (vendor == "GE") {
    if (const auto mm_s = number(data, DcmTagKey(0x0019, 0x10cc)); mm_s && *mm_s > 0)
      return VelocityEncoding{0.1 * *mm_s, "GE (0019,10cc)"};
  }
  if (vendor == "Philips") {
    for (unsigned long i = 0; i < 3; ++i) {
      const auto venc = number(data, DcmTagKey(0x2001, 0x101a), i);
      if (venc && *venc != 0) return VelocityEncoding{std::abs(*venc), "Philips (2001,101a)"};
    }
  }
  const auto units = text(data, DCM_RescaleType);
  const double lowest = number(data, DCM_RescaleIntercept).value_or(0);
  if (units == "cm/s" && lowest < 0) return VelocityEncoding{-lowest, "RescaleIntercept in cm/s"};
  return std::nullopt;
}

/// The bytes of a private value that arrived without its type (UN, or in an implicit transfer syntax).
std::optional<std::string> untyped(DcmItem& item, const DcmTagKey& tag) {
  DcmElement* element = nullptr;
  if (item.findAndGetElement(tag, element).bad() || dynamic_cast<DcmOtherByteOtherWord*>(element) == nullptr)
    return std::nullopt;
  Uint8* bytes = nullptr;
  if (element->getUint8Array(bytes).bad() || bytes == nullptr) return std::nullopt;
  return std::string(bytes, bytes + element->getLength());
}

/// A private decimal text (IS, DS), typed or not.
std::optional<double> private_text_number(DcmItem& item, const DcmTagKey& tag) {
  const auto bytes = untyped(item, tag);
  if (!bytes) return number(item, tag);
  char* end = nullptr;
  const double value = std::strtod(bytes->c_str(), &end);
  return end != bytes->c_str() && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// `count` private doubles (FD), typed or not.
std::optional<std::vector<double>> private_doubles(DcmItem& item, const DcmTagKey& tag, size_t count) {
  std::vector<double> values(count);
  if (const auto bytes = untyped(item, tag)) {
    if (bytes->size() < count * sizeof(double)) return std::nullopt;
    std::memcpy(values.data(), bytes->data(), count * sizeof(double));
  } else {
    for (size_t i = 0; i < count; ++i) {
      const auto value = number(item, tag, static_cast<unsigned long>(i));
      if (!value) return std::nullopt;
      values[i] = *value;
    }
  }
  for (const double value : values)
    if (!std::isfinite(value)) return std::nullopt;
  return values;
}

/// xx, xy, xz, yy, yz, zz.
Eigen::Matrix3d symmetric(const std::vector<double>& upper) {
  Eigen::Matrix3d matrix;
  matrix << upper[0], upper[1], upper[2], upper[1], upper[3], upper[4], upper[2], upper[4], upper[5];
  return matrix;
}

/// (0018,9601) in the item or, as some write it, its members without the sequence.
std::optional<Eigen::Matrix3d> standard_b_matrix(DcmItem& item) {
  DcmItem* inside = nullptr;
  DcmItem& holder =
      item.findAndGetSequenceItem(DCM_DiffusionBMatrixSequence, inside).good() && inside ? *inside : item;
  std::vector<double> upper;
  for (const DcmTagKey& tag : {DCM_DiffusionBValueXX, DCM_DiffusionBValueXY, DCM_DiffusionBValueXZ,
                               DCM_DiffusionBValueYY, DCM_DiffusionBValueYZ, DCM_DiffusionBValueZZ}) {
    const auto value = number(holder, tag);
    if (!value) return std::nullopt;
    upper.push_back(*value);
  }
  return symmetric(upper);
}

std::optional<Eigen::Vector3d> standard_direction(DcmItem& item) {
  DcmItem* inside = nullptr;
  if (item.findAndGetSequenceItem(DCM_DiffusionGradientDirectionSequence, inside).good() && inside)
    return vector3(*inside, DCM_DiffusionGradientOrientation);
  return vector3(item, DCM_DiffusionGradientOrientation);
}

std::optional<DiffusionEncoding> diffusion_of(const FrameItems& items, const std::string& vendor) {
  DcmItem& data = items.dataset();
  auto b = items.number_in(DCM_MRDiffusionSequence, DCM_DiffusionBValue);
  if (!b && vendor == "Siemens") b = private_text_number(data, DcmTagKey(0x0019, 0x100c));
  if (!b && vendor == "Philips") b = number(data, DcmTagKey(0x2001, 0x1003));
  if (!b && vendor == "GE") {
    b = number(data, DcmTagKey(0x0043, 0x1039));
    if (b) b = std::fmod(*b, 1e6);  // GE adds 1e9 to those of a multi-shell protocol
  }
  auto direction = items.find(DCM_MRDiffusionSequence, standard_direction);
  auto matrix = items.find(DCM_MRDiffusionSequence, standard_b_matrix);
  if (vendor == "Siemens") {
    if (const auto g = private_doubles(data, DcmTagKey(0x0019, 0x100e), 3); g && !direction)
      direction = Eigen::Vector3d((*g)[0], (*g)[1], (*g)[2]);
    if (const auto upper = private_doubles(data, DcmTagKey(0x0019, 0x1027), 6); upper && !matrix)
      matrix = symmetric(*upper);
  }
  if (!b && matrix) b = matrix->trace();
  if (!b || *b < 0) return std::nullopt;
  constexpr double least_length = 0.1;  // scanners write (0,0,0) where they mean none
  if (direction && direction->norm() > least_length) {
    direction->normalize();
  } else {
    direction.reset();
  }
  return DiffusionEncoding{*b, direction, matrix};
}

FileFault unusable(std::string place, std::string problem, std::string remedy) {
  return {FileFault::Kind::unusable, std::move(place), std::move(problem), std::move(remedy)};
}

/// Reads the plane; nothing if position, orientation or spacing is absent or no plane.
std::optional<SlicePlane> plane_of(const FrameItems& items) {
  SlicePlane plane;
  const auto position = items.find(DCM_PlanePositionSequence,
                                   [](DcmItem& item) { return vector3(item, DCM_ImagePositionPatient); });
  const auto along_row = items.find(DCM_PlaneOrientationSequence,
                                    [](DcmItem& item) { return vector3(item, DCM_ImageOrientationPatient); });
  const auto along_column = items.find(DCM_PlaneOrientationSequence, [](DcmItem& item) {
    return vector3(item, DCM_ImageOrientationPatient, 3);
  });
  const auto between_rows = items.number_in(DCM_PixelMeasuresSequence, DCM_PixelSpacing, 0);
  const auto between_columns = items.number_in(DCM_PixelMeasuresSequence, DCM_PixelSpacing, 1);
  if (!position || !along_row || !along_column || !between_rows || !between_columns) return std::nullopt;
  const bool is_plane = std::abs(along_row->norm() - 1) < 1e-2 && std::abs(along_column->norm() - 1) < 1e-2 &&
                        std::abs(along_row->dot(*along_column)) < 1e-2 &&
                        std::clamp(*between_rows, narrowest_mm, widest_mm) == *between_rows &&
                        std::clamp(*between_columns, narrowest_mm, widest_mm) == *between_columns &&
                        position->cwiseAbs().maxCoeff() < furthest_mm;
  if (!is_plane) return std::nullopt;
  plane.origin_mm = *position;
  plane.along_row = along_row->normalized();
  plane.along_column = (*along_column - along_column->dot(plane.along_row) * plane.along_row).normalized();
  plane.row_spacing_mm = *between_rows;
  plane.column_spacing_mm = *between_columns;
  plane.rows = static_cast<int>(number(items.dataset(), DCM_Rows).value_or(0));
  plane.columns = static_cast<int>(number(items.dataset(), DCM_Columns).value_or(0));
  plane.thickness_mm =
      std::max(0.0, items.number_in(DCM_PixelMeasuresSequence, DCM_SliceThickness).value_or(0));
  return plane;
}

ImageHeader header_of(DcmItem& dataset, int frame, const SlicePlane& plane, const FrameItems& items) {
  ImageHeader header;
  header.frame = frame;
  header.plane = plane;
  header.series_uid = text(dataset, DCM_SeriesInstanceUID).value_or("");
  header.instance_uid = text(dataset, DCM_SOPInstanceUID).value_or("");
  header.series_number =
      static_cast<int>(std::clamp(number(dataset, DCM_SeriesNumber).value_or(0), -1e9, 1e9));
  header.instance = static_cast<int>(std::clamp(number(dataset, DCM_InstanceNumber).value_or(0), -1e9, 1e9));
  header.vendor = vendor_of(dataset);
  header.trigger_ms = items.number_in(DCM_CardiacSynchronizationSequence, DCM_NominalCardiacTriggerDelayTime);
  if (!header.trigger_ms)
    header.trigger_ms =
        items.number_in(DCM_CardiacSynchronizationSequence, DCM_ActualCardiacTriggerDelayTime);
  if (!header.trigger_ms) header.trigger_ms = number(dataset, DCM_TriggerTime);
  if (header.trigger_ms && std::abs(*header.trigger_ms) > longest_ms) header.trigger_ms.reset();
  header.interval_ms = items.number_in(DCM_CardiacSynchronizationSequence, DCM_RRIntervalTimeNominal);
  if (!header.interval_ms) header.interval_ms = number(dataset, DCM_NominalInterval);
  if (const auto announced = number(dataset, DCM_CardiacNumberOfImages))
    header.phases_announced = static_cast<int>(std::clamp(*announced, 0.0, 1e6));
  header.component = component_of(items);
  const auto tagging =
      items.find(DCM_MRModifierSequence, [](DcmItem& item) { return text(item, DCM_Tagging); });
  header.says_tagged = tagging && *tagging != "NONE";
  header.velocity = velocity_of(items, header.vendor);
  header.diffusion = diffusion_of(items, header.vendor);
  header.slope = items.number_in(DCM_PixelValueTransformationSequence, DCM_RescaleSlope).value_or(1.0);
  header.intercept =
      items.number_in(DCM_PixelValueTransformationSequence, DCM_RescaleIntercept).value_or(0.0);
  header.rescale_units = items
                             .find(DCM_PixelValueTransformationSequence,
                                   [](DcmItem& item) { return text(item, DCM_RescaleType); })
                             .value_or("");
  return header;
}

struct PixelLayout {
  int rows, columns, frames, bits_allocated, bits_stored, high_bit;
  bool is_signed;

  [[nodiscard]] size_t frame_bytes() const {
    return static_cast<size_t>(rows) * static_cast<size_t>(columns) * static_cast<size_t>(bits_allocated / 8);
  }
};

std::optional<FileFault> check_layout(DcmItem& dataset, PixelLayout& layout) {
  const auto whole = [&](const DcmTagKey& tag, double otherwise) {
    return static_cast<int>(std::clamp(number(dataset, tag).value_or(otherwise), -1.0, 1e6));
  };
  layout = {whole(DCM_Rows, 0),
            whole(DCM_Columns, 0),
            whole(DCM_NumberOfFrames, 1),
            whole(DCM_BitsAllocated, 0),
            whole(DCM_BitsStored, 0),
            whole(DCM_HighBit, whole(DCM_BitsStored, 0) - 1),
            whole(DCM_PixelRepresentation, 0) == 1};
  const auto in_range = [](int value, int most) { return value >= 1 && value <= most; };
  if (!in_range(layout.rows, most_pixels_a_side) || !in_range(layout.columns, most_pixels_a_side) ||
      !in_range(layout.frames, most_frames))
    return unusable("(0028,0010), (0028,0011), (0028,0008)",
                    fmt::format("{} rows, {} columns, {} frames are no MR image", layout.rows, layout.columns,
                                layout.frames),
                    "Export the series again.");
  DcmSequenceOfItems* described = nullptr;
  if (dataset.findAndGetSequence(DCM_PerFrameFunctionalGroupsSequence, described).good() &&
      described != nullptr && described->card() != static_cast<unsigned long>(layout.frames))
    return unusable("(0028,0008)",
                    fmt::format("{} frames, and (5200,9230) describes {}", layout.frames, described->card()),
                    "Export the series again.");
  if (whole(DCM_SamplesPerPixel, 1) != 1 || (layout.bits_allocated != 8 && layout.bits_allocated != 16) ||
      !in_range(layout.bits_stored, layout.bits_allocated))
    return unusable("(0028,0100)",
                    fmt::format("{} samples of {} bits a pixel, {} of them used, are not read",
                                whole(DCM_SamplesPerPixel, 1), layout.bits_allocated, layout.bits_stored),
                    "Export the original images, grey levels of 8 or 16 bits, not screen copies.");
  if (layout.high_bit < layout.bits_stored - 1 || layout.high_bit >= layout.bits_allocated)
    return unusable("(0028,0102)",
                    fmt::format("the highest of {} bits in {} cannot be bit {}", layout.bits_stored,
                                layout.bits_allocated, layout.high_bit),
                    "Export the series again.");
  return std::nullopt;
}

std::optional<FileFault> check_syntax(DcmFileFormat& file) {
  const auto refused = [](std::string_view name) {
    return unusable("(0002,0010)",
                    fmt::format("its pixels are compressed in a way that is not read: {}", name),
                    "Export it uncompressed, or with its pixels compressed by JPEG lossless or RLE.");
  };
  // Of a syntax that is younger than the library, that reads the pixels as if they were not compressed.
  const std::string stated = text(*file.getMetaInfo(), DCM_TransferSyntaxUID).value_or("");
  if (!stated.empty() && DcmXfer(stated.c_str()).getXfer() == EXS_Unknown) return refused(stated);
  const E_TransferSyntax syntax = file.getDataset()->getOriginalXfer();
  if (!DcmXfer(syntax).isEncapsulated() || DcmCodecList::canChangeCoding(syntax, EXS_LittleEndianExplicit))
    return std::nullopt;
  return refused(DcmXfer(syntax).getXferName());
}

/// Native pixels must all be there; compressed ones may be smaller by what their codec can do at most.
std::optional<FileFault> check_length(DcmDataset& dataset, const PixelLayout& layout, double file_bytes) {
  DcmElement* element = nullptr;
  if (dataset.findAndGetElement(DCM_PixelData, element).bad() || element == nullptr)
    return FileFault{FileFault::Kind::truncated, "(7fe0,0010)", "the pixels are missing",
                     "Copy or export the file again."};
  const double needed = static_cast<double>(layout.frame_bytes()) * layout.frames;
  const bool compressed = DcmXfer(dataset.getOriginalXfer()).isEncapsulated();
  const double held = compressed ? most_compression * file_bytes : static_cast<double>(element->getLength());
  if (held + 0.5 < needed)
    return FileFault{
        FileFault::Kind::truncated, "(7fe0,0010)",
        fmt::format("{} x {} pixels, {} times, need {:.0f} bytes, and the file has {:.0f}", layout.rows,
                    layout.columns, layout.frames, needed, compressed ? file_bytes : held),
        "Copy or export the file again."};
  return std::nullopt;
}

/// DICOM has its mark at byte 128; older files begin with group 0002 or 0008 at once.
bool looks_like_dicom(std::ifstream& stream) {
  std::array<char, 132> start{};
  stream.read(start.data(), start.size());
  const auto count = static_cast<size_t>(stream.gcount());
  if (count == start.size() && std::string_view(start.data() + 128, 4) == "DICM") return true;
  return count >= 8 && (start[0] == 2 || start[0] == 8) && start[1] == 0 && start[3] == 0;
}

/// What is left of a DICOM file that was cut off in the 128 bytes before its mark, which are zeros as a rule. Its name has no ending, as scanners
/// write them, or the one of DICOM.
bool is_stub(std::ifstream& stream, const std::filesystem::path& file, double bytes) {
  if (bytes >= 132 || file.filename().string().starts_with('.')) return false;
  if (!file.extension().empty() && !claims_to_be_dicom(file)) return false;
  std::array<char, 132> start{};
  stream.read(start.data(), start.size());
  const bool is_blank = std::ranges::all_of(start, [](char c) { return c == 0; });
  stream.clear();
  stream.seekg(0);
  return is_blank;
}

/// How deep items lie within items of undefined length, or of one that holds the others.
size_t depth_of_items(std::istream& stream, std::endian order) {
  const bool is_little = order == std::endian::little;
  const std::string_view delimiter(is_little ? "\xfe\xff" : "\xff\xfe", 2);
  const std::string_view begin(is_little ? "\xfe\xff\x00\xe0" : "\xff\xfe\xe0\x00", 4);
  const std::string_view end(is_little ? "\xfe\xff\x0d\xe0" : "\xff\xfe\xe0\x0d", 4);
  constexpr uint32_t undefined = 0xffffffff;
  constexpr size_t tag_and_length = 8;
  std::vector<size_t> ends;  // of the items around a place
  size_t most = 0, window_at = 0;
  std::string window, block(1U << 16U, '\0');
  while (stream.read(block.data(), static_cast<std::streamsize>(block.size())), stream.gcount() > 0) {
    window.append(block, 0, static_cast<size_t>(stream.gcount()));
    size_t at = window.find(delimiter);
    for (; at != std::string::npos && at + tag_and_length <= window.size();
         at = window.find(delimiter, at + 2)) {
      const std::string_view tag(window.data() + at, begin.size());
      while (!ends.empty() && ends.back() <= window_at + at)
        ends.pop_back();
      if (tag == end && !ends.empty()) ends.pop_back();
      uint32_t length = 0;
      std::memcpy(&length, window.data() + at + begin.size(), sizeof length);
      if (!is_little) length = __builtin_bswap32(length);
      if (tag != begin || length == 0) continue;
      ends.push_back(length == undefined ? SIZE_MAX : window_at + at + tag_and_length + length);
      most = std::max(most, ends.size());
    }
    const size_t done =
        at != std::string::npos ? at : window.size() - 1;  // the last byte may begin a delimiter
    window.erase(0, done);
    window_at += done;
  }
  return most;
}

/// What the library would meet with more memory or deeper calls than the file is worth.
std::optional<FileFault> check_before_loading(std::ifstream& stream, const std::filesystem::path& file) {
  DcmMetaInfo meta;
  OFString stated;
  if (meta.loadFile(file.c_str()).good()) (void)meta.findAndGetOFString(DCM_TransferSyntaxUID, stated);
  const DcmXfer syntax(stated.c_str());
  if (syntax.getStreamCompression() != ESC_none)
    return unusable("(0002,0010)", "is deflated as a whole, and how large it becomes no header says",
                    "Export it uncompressed, or with its pixels compressed (JPEG lossless, RLE).");
  // Of a file that does not say, the library guesses the order.
  const bool is_said = syntax.getXfer() != EXS_Unknown;
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    if (is_said && syntax.isBigEndian() != (order == std::endian::big)) continue;
    stream.clear();
    stream.seekg(0);
    if (const size_t depth = depth_of_items(stream, order); depth > deepest)
      return unusable("(fffe,e000)", fmt::format("holds {} sequences within each other", depth),
                      "No scanner writes this. Export the file again.");
  }
  return std::nullopt;
}

struct LoadedFile {
  std::unique_ptr<DcmFileFormat> format;
  double bytes = 0;
  std::optional<FileFault> fault;
};

LoadedFile load(const std::filesystem::path& file) {
  prepare_library();
  LoadedFile loaded;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    loaded.fault = unusable("", fmt::format("cannot be read: {}", std::strerror(errno)),
                            "Give yourself the right to read it, or move it out of the folder.");
    return loaded;
  }
  std::error_code ignored;
  loaded.bytes = static_cast<double>(std::filesystem::file_size(file, ignored));
  if (is_stub(stream, file, loaded.bytes)) {
    loaded.fault = FileFault{FileFault::Kind::truncated, "",
                             loaded.bytes == 0 ? "is empty" : "ends before its first value",
                             "Copy or export the file again."};
    return loaded;
  }
  if (!looks_like_dicom(stream)) {
    loaded.fault = FileFault{FileFault::Kind::foreign, "", "is no DICOM file", "Move it out of the folder."};
    return loaded;
  }
  if ((loaded.fault = check_before_loading(stream, file))) return loaded;
  loaded.format = std::make_unique<DcmFileFormat>();
  const OFCondition read = loaded.format->loadFile(file.c_str());
  if (read.bad())
    loaded.fault = FileFault{FileFault::Kind::truncated, "",
                             fmt::format("ends too early or is damaged ({})", read.text()),
                             "Copy or export the file again."};
  return loaded;
}

/// A code string (PS3.5 6.2) as it is, and of what is none only that: it may hold a name, or what a terminal obeys.
std::string code(const std::string& value) {
  const bool is_code = value.size() <= 16 && std::ranges::all_of(value, [](char c) {
                         return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == ' ' || c == '_';
                       });
  return is_code ? value : "that is no code";
}

std::optional<FileFault> check_modality(DcmItem& dataset) {
  const std::string modality = text(dataset, DCM_Modality).value_or("");
  const std::string sop_class = text(dataset, DCM_SOPClassUID).value_or("");
  const bool is_mr = modality == "MR" && (sop_class.empty() || sop_class == UID_MRImageStorage ||
                                          sop_class == UID_EnhancedMRImageStorage ||
                                          sop_class == UID_LegacyConvertedEnhancedMRImageStorage);
  if (is_mr) return std::nullopt;
  return FileFault{FileFault::Kind::not_mr, "(0008,0060)",
                   fmt::format("is no MR image: modality {}", modality.empty() ? "absent" : code(modality)),
                   "Move it out of the folder."};
}

/// How many bytes a segment of RLE (PS3.5 Annex G) holds, or more than `most`; a last byte that makes it even is none of them.
size_t unpacked(std::span<const uint8_t> segment, size_t most) {
  size_t held = 0, at = 0;
  while (at + 1 < segment.size() && held < most) {
    const auto count = static_cast<int8_t>(segment[at]);
    if (count >= 0) {
      held += std::min(static_cast<size_t>(count) + 1, segment.size() - at - 1);
      at += static_cast<size_t>(count) + 2;
    } else {
      held += count == -128 ? 0 : static_cast<size_t>(1 - count);
      at += count == -128 ? 1 : 2;
    }
  }
  const auto rest = segment.subspan(std::min(at, segment.size()));
  const bool is_padding =
      rest.size() <= 1 || std::ranges::all_of(rest, [](uint8_t byte) { return byte == 0 || byte == 0x80; });
  return is_padding ? held : most + 1;
}

/// The library fills up what a frame of RLE lacks, and cuts off what it has too much.
bool is_whole_rle(DcmDataset& dataset, DcmPixelData& pixels, const PixelLayout& layout, int frame) {
  DcmPixelSequence* fragments = nullptr;
  if (dataset.getOriginalXfer() != EXS_RLELossless ||
      pixels.getEncapsulatedRepresentation(EXS_RLELossless, nullptr, fragments).bad() || fragments == nullptr)
    return true;
  // After the table of offsets, one a frame (PS3.5 A.4.2).
  DcmPixelItem* fragment = nullptr;
  Uint8* bytes = nullptr;
  if (fragments->getItem(fragment, static_cast<unsigned long>(frame) + 1).bad() || fragment == nullptr ||
      fragment->getUint8Array(bytes).bad() || bytes == nullptr)
    return false;
  const std::span<const uint8_t> all(bytes, fragment->getLength());
  constexpr size_t header_bytes = 64;
  const auto segments = static_cast<size_t>(layout.bits_allocated / 8);
  std::array<uint32_t, 16> header{};  // their number, and where each begins
  if (all.size() < header_bytes) return false;
  std::memcpy(header.data(), all.data(), header_bytes);
  if (header[0] != segments) return false;
  const size_t needed = layout.frame_bytes() / segments;
  for (size_t i = 1; i <= segments; ++i) {
    const size_t from = header[i], to = i < segments ? header[i + 1] : all.size();
    if (from < header_bytes || to < from || to > all.size() ||
        unpacked(all.subspan(from, to - from), needed) != needed)
      return false;
  }
  return true;
}

float decoded(const PixelLayout& layout, const uint8_t* bytes, size_t index) {
  uint32_t raw = bytes[index];
  if (layout.bits_allocated == 16) {
    uint16_t word = 0;
    std::memcpy(&word, bytes + 2 * index, sizeof word);
    raw = word;
  }
  const auto bits = static_cast<unsigned>(layout.bits_stored);
  raw = (raw >> static_cast<unsigned>(layout.high_bit + 1 - layout.bits_stored)) & ((1U << bits) - 1U);
  const bool negative = layout.is_signed && (raw >> (bits - 1U)) != 0U;
  return static_cast<float>(raw) - (negative ? static_cast<float>(1U << bits) : 0.0F);
}

}  // namespace

bool claims_to_be_dicom(const std::filesystem::path& file) {
  const std::string ending = in_small_letters(file.extension().string());
  return ending == ".dcm" || ending == ".dicom" || ending == ".ima";
}

std::optional<Eigen::Matrix3d> DiffusionEncoding::weighting() const {
  if (b_matrix) return b_matrix;
  if (direction) return Eigen::Matrix3d(b_s_mm2 * *direction * direction->transpose());
  if (b_s_mm2 == 0) return Eigen::Matrix3d::Zero();
  return std::nullopt;
}

DicomContent read_headers(const std::filesystem::path& file) {
  DicomContent content;
  LoadedFile loaded = load(file);
  content.fault = loaded.fault;
  if (content.fault) return content;
  DcmDataset& dataset = *loaded.format->getDataset();
  PixelLayout layout{};
  if (text(dataset, DCM_MediaStorageSOPClassUID).value_or("") == UID_MediaStorageDirectoryStorage ||
      dataset.tagExists(DCM_DirectoryRecordSequence))
    return content;  // a DICOMDIR: a table of contents
  if ((content.fault = check_modality(dataset))) return content;
  if ((content.fault = check_syntax(*loaded.format))) return content;
  if ((content.fault = check_layout(dataset, layout))) return content;
  if ((content.fault = check_length(dataset, layout, loaded.bytes))) return content;
  for (int frame = 0; frame < layout.frames; ++frame) {
    const FrameItems items(dataset, frame);
    const auto plane = plane_of(items);
    if (!plane) {
      content.images.clear();
      content.fault =
          unusable("(0020,0032), (0020,0037), (0028,0030)",
                   fmt::format("position, orientation or pixel spacing of frame {} is absent, or no value "
                               "that an MR image can have",
                               frame + 1),
                   "Export the original images; converted ones lose where they lie.");
      return content;
    }
    content.images.push_back(header_of(dataset, frame, *plane, items));
    if (content.images.back().slope == 0) {
      content.images.clear();
      content.fault =
          unusable("(0028,1053)", fmt::format("a rescale slope of 0 makes frame {} blank", frame + 1),
                   "Export the original images.");
      return content;
    }
  }
  return content;
}

std::vector<Image> read_pixels(const std::filesystem::path& file, const std::vector<ImageHeader>& images) {
  LoadedFile loaded = load(file);
  const auto refuse = [&](const FileFault& fault) {
    return InputError({file.string(), fault.place, fault.problem, fault.remedy});
  };
  if (loaded.fault) throw refuse(*loaded.fault);
  DcmDataset& dataset = *loaded.format->getDataset();
  PixelLayout layout{};
  if (const auto fault = check_layout(dataset, layout)) throw refuse(*fault);
  if (const auto fault = check_length(dataset, layout, loaded.bytes)) throw refuse(*fault);
  DcmElement* element = nullptr;
  (void)dataset.findAndGetElement(DCM_PixelData, element);
  auto* pixels = dynamic_cast<DcmPixelData*>(element);
  std::vector<uint8_t> bytes(layout.frame_bytes() + layout.frame_bytes() % 2);
  std::vector<Image> decoded_images;
  for (const ImageHeader& image : images) {
    OFString colour_model;
    Uint32 fragment = 0;  // the library finds the frame's own
    const bool read =
        pixels != nullptr && image.frame < layout.frames &&
        is_whole_rle(dataset, *pixels, layout, image.frame) &&
        pixels
            ->getUncompressedFrame(&dataset, static_cast<Uint32>(image.frame), fragment, bytes.data(),
                                   static_cast<Uint32>(bytes.size()), colour_model)
            .good();
    if (!read)
      throw refuse(
          {FileFault::Kind::truncated, fmt::format("frame {}", image.frame + 1),
           fmt::format("the pixels cannot be decoded ({})", DcmXfer(dataset.getOriginalXfer()).getXferName()),
           "Copy or export the file again, uncompressed if need be."});
    Image values(layout.rows, layout.columns);
    for (int row = 0; row < layout.rows; ++row) {
      for (int column = 0; column < layout.columns; ++column) {
        const size_t index =
            static_cast<size_t>(row) * static_cast<size_t>(layout.columns) + static_cast<size_t>(column);
        values(row, column) = static_cast<float>(
            image.slope * static_cast<double>(decoded(layout, bytes.data(), index)) + image.intercept);
      }
    }
    decoded_images.push_back(std::move(values));
  }
  return decoded_images;
}

}  // namespace diastole::imaging
