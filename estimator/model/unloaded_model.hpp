#pragma once
// A study whose shape was imaged under load ([specimen] imaged_at_kPa), without that load: what `--unload` does.

#include <optional>
#include <string>
#include <string_view>

#include "estimator/fe/unloaded_shape.hpp"
#include "estimator/io/study.hpp"
#include "estimator/mesh/mesh_file.hpp"

namespace diastole {

/// Throws InputError if the study's body is more than material between held ends: springs at them, fluid in a chamber, effects that show in
/// images. `purpose` ends the sentence "... but PURPOSE".
void require_plain(const Study& study, std::string_view purpose);

/// The load at which the study's shape was imaged. Throws InputError if the study does not say it, or if its specimen cannot be
/// unloaded: ends on springs and fluid in a chamber are known from the undeformed body alone, as are effects that show in images.
ImagedLoad imaged_load_of(const Study& study);

struct UnloadedModel {
  ElasticModel imaged;     ///< its mesh is the imaged shape
  UnloadedShape shape;     ///< whose report says whether there is one
  ElasticModel model;      ///< of the unloaded body; of the imaged one where there is none
  UnloadReturn back = {};  ///< from the unloaded shape to the imaged pressure

  /// Whether there is such a shape, and the load brings the image back (UnloadReturn::returned).
  [[nodiscard]] bool returned() const;
  /// A sentence on how that ended.
  [[nodiscard]] std::string describe() const;
};

/// Parameters take their `start`. Throws InputError as imaged_load_of and make_affected_model (affected_model.hpp).
UnloadedModel unload(const Study& study, const SolveOptions& options = {});

/// The unloaded body as a mesh file holds it: the carried fibres as nodal angles, tri-linear between the nodes.
struct UnloadedBody {
  MeshBody body;
  double fibre_rms_deg = 0.0;  ///< between those and the carried fibres, over the Gauss points
};
UnloadedBody unloaded_body(const UnloadedModel& unloaded);

}  // namespace diastole
