// Every text or binary file that a person may hand over, but run files and images (fuzz_runfile, fuzz_dicom): it is read, or refused
// with InputError.
//
//   input: one byte that says what the file is (its number in file_kinds.hpp), then the file

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/effect_files/effect_file.hpp"
#include "estimator/explain/rig/reference_json.hpp"
#include "estimator/grids/gmsh_file.hpp"
#include "estimator/grids/vtu_file.hpp"
#include "estimator/grids/xdmf_file.hpp"
#include "estimator/imaging/diffusion/nifti_series.hpp"
#include "estimator/imaging/geometry/guide_points.hpp"
#include "estimator/imaging/tracking/manual_edits.hpp"
#include "estimator/imaging/tracking/specimen_pose.hpp"
#include "estimator/io/fibre_points.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/flow_file.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"
#include "estimator/io/tracking_file.hpp"
#include "estimator/law_fit/bench_test.hpp"
#include "estimator/materials/file_law.hpp"
#include "estimator/mesh/exfile_import.hpp"
#include "estimator/mesh/mesh_file.hpp"
#include "host/config/experiment.hpp"
#include "host/config/points_file.hpp"
#include "host/config/rig_config.hpp"
#include "host/flash/elf_symbols.hpp"
#include "host/flash/update_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "protocol/signing/signing_key.hpp"
#include "tests/fuzz/file_kinds.hpp"
#include "tests/host/bench/scratch.hpp"

namespace {

using namespace diastole;

/// The text as a file, for readers that want one.
std::filesystem::path as_file(std::string_view text, const char* name) {
  static const Scratch scratch("fuzz-files");
  const std::filesystem::path file = scratch / name;
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
  return file;
}

/// Of two slices, one with a grid of tags, in two phases each.
std::vector<imaging::TagView> tag_views() {
  imaging::TagView view;
  view.plane.rows = 12;
  view.plane.columns = 16;
  view.images.resize(2);
  view.frames = {1, 2};
  view.waves = {{.per_mm = {0.2, 0.0}, .offset_cycles = 0.5, .modulation = 1.0, .prominence = 100.0}};
  view.name = "series 2, slice 1";
  imaging::TagView grid = view;
  grid.waves.push_back({.per_mm = {0.0, 0.2}, .offset_cycles = 0.0, .modulation = 1.0, .prominence = 100.0});
  grid.name = "series 2, slice 2";
  return {view, grid};
}

void read(fuzz::FileKind kind, std::string_view text) {
  using enum fuzz::FileKind;
  constexpr int frames = 8;
  switch (kind) {
    case rig:
      return (void)read_rig(TableReader::from_text(std::string(text), "rig"));
    case experiment:
      return (void)parse_experiment(text, "experiment",
                                    [](const std::string&) { return "phase,fraction\n0,0\n.5,1\n1,0\n"; });
    case waveform:
      return (void)parse_points(text, "points", PointsOf::volume_or_pressure);
    case study:
      return (void)read_study(as_file(text, "a.study.toml"));
    case frame_table:
      return (void)read_frames(as_file(text, "a.frames.csv"));
    case tag_table:
      return (void)read_tags(as_file(text, "a.tags.csv"), frames);
    case point_table:
      return (void)read_points(as_file(text, "a.points.csv"), frames);
    case fibre_table:
      return (void)read_fibre_points(as_file(text, "a.fibres.csv"));
    case mesh:
      return (void)mesh_from_text(text, "mesh");
    case exfiles: {
      const size_t middle = text.find('\f');
      return (void)import_exfiles({text.substr(0, middle), "exnode"},
                                  {middle == text.npos ? text : text.substr(middle + 1), "exelem"}, 1);
    }
    case effect:
      return (void)effect_files::read_effect_text(text, "effect");
    case law:
      return (void)read_law_text(text, "law");
    case fit:
      return (void)fit_record_from_json(text, "fit");
    case tracking:
      return (void)tracking_record_from_json(text, "tracking");
    case flow:
      return (void)flow_record_from_json(text, "flow");
    case gmsh:
      return (void)read_gmsh(as_file(text, "a.msh"));
    case vtu:
      return (void)read_vtu(as_file(text, "a.vtu"));
    case xdmf:
      return (void)read_xdmf(as_file(text, "a.xdmf"));
    case update:
      return (void)parse_update_file("update", {text.begin(), text.end()});
    case key: {
      const std::filesystem::path file = as_file(text, "key.pem");
      std::filesystem::permissions(file,
                                   std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
      try {
        return (void)signing::read_key_file(file);
      } catch (const std::runtime_error&) {
        return;
      }
    }
    case elf:
      return (void)ElfSymbols(as_file(text, "a.elf")).name_at(0x0802'0000);
    case guide:
      return (void)imaging::guide_points_from_text(text, "guide");
    case bench_test:
      return (void)read_bench_test(as_file(text, "a.csv"));
    case nifti: {
      const size_t last = text.rfind('\f'), middle = last == 0 ? text.npos : text.rfind('\f', last - 1);
      if (last == text.npos || middle == text.npos) return;
      return (void)imaging::read_nifti({as_file(text.substr(0, middle), "a.nii"),
                                        as_file(text.substr(middle + 1, last - middle - 1), "a.bval"),
                                        as_file(text.substr(last + 1), "a.bvec")});
    }
    case edits: {
      std::vector<imaging::TagView> views = tag_views();
      return imaging::apply_edits(imaging::parse_edits(text, "edits"), views);
    }
    case pose: {
      const Eigen::Matrix3d axes = imaging::read_pose(as_file(text, "a.pose.toml")).axes;
      if (!(axes.transpose() * axes).isIdentity(1e-2)) std::abort();
      return;
    }
    case reference:
      return (void)explain::reference_from_json(text, "reference");
    case count:
      return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto kind = static_cast<fuzz::FileKind>(data[0] % static_cast<unsigned>(fuzz::FileKind::count));
  try {
    read(kind, {reinterpret_cast<const char*>(data) + 1, size - 1});
  } catch (const InputError&) {
  }
  return 0;
}
