#pragma once
// What a person put right by hand: NAME.edits.jsonl, one choice a line, replayed in order by every tracking (docs/imaging.md has the
// format). Places are pixels of the image: column and row, counted from the centre of the first pixel.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/imaging/tracking/tag_view.hpp"

namespace diastole::imaging {

enum class EditAction { line, mask, contour, height };

struct ManualEdit {
  size_t file_line = 0;  ///< from 1
  EditAction action = EditAction::mask;
  std::string slice;                  ///< as `track` names it: "series 2, slice 1"
  std::optional<int> direction = {};  ///< of a line, from 1; may be absent where the slice has one
  std::optional<int> phase = {};      ///< from 1; absent: all of them, of a mask
  int tag = 0;                        ///< number of a line's tag
  bool is_outer = false;              ///< of a contour
  std::vector<Eigen::Vector2d> points_px;
  double height_mm = 0;  ///< of a slice across the axis, over the specimen's mid-height
  std::string text;      ///< the line itself
};

struct ManualEdits {
  std::filesystem::path file;
  std::vector<ManualEdit> standing;  ///< those that were not undone, in their order
  size_t undone = 0;
};

/// Where choices about a folder stand unless another file is named: FOLDER.edits.jsonl, beside the folder.
std::filesystem::path edits_beside(const std::filesystem::path& folder);

/// Throws InputError (file, line, value, remedy) for a line that is no choice, and for an undo of nothing.
ManualEdits parse_edits(std::string_view text, const std::filesystem::path& file);

/// Sets the edits of all views. Throws InputError for a choice that does not fit them: an unknown slice, direction, phase or tag, a
/// point outside the image.
void apply_edits(const ManualEdits& edits, std::vector<TagView>& views);

/// How many of each action stand: "line", "mask", "contour", "height".
std::map<std::string, size_t> counts_of(const ManualEdits& edits);

}  // namespace diastole::imaging
