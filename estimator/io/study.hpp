#pragma once
// The study file `NAME.study.toml` (format "diastole-study", version 1): the specimen, the law whose
// parameters are sought with their starts and bounds, and the measurements. Lengths in mm, pressures in kPa,
// angles in deg.

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace diastole {

/// Glue of finite stiffness between an end face and its plate (estimator/fe/spring_bond.hpp).
struct EndSprings {
  double normal_kPa_per_mm;      ///< >= 0
  double tangential_kPa_per_mm;  ///< >= 0
};

/// A cylindrical annulus along z, mid-height at z = 0, both end faces bonded to rigid plates, loaded by a
/// follower pressure on its inner wall.
struct AnnulusSpecimen {
  double inner_radius_mm;
  double outer_radius_mm;
  double height_mm;
  std::array<int, 3> mesh;                  ///< elements: circumferential, longitudinal, transmural
  std::string ends;                         ///< "fixed", or "sprung"
  std::optional<EndSprings> end_springs{};  ///< given if the ends are sprung
};

/// A left ventricle: a thick ellipsoid of revolution about z, apex down, cut at z = base_z_mm where it is
/// held, loaded by a follower pressure on its inner wall. Fibre angles are measured from the circumference
/// towards the base and go linearly through the wall (estimator/mesh/ellipsoid.hpp).
struct EllipsoidSpecimen {
  std::array<double, 2> inner_axes_mm;  ///< semi-axes across z and along z
  std::array<double, 2> outer_axes_mm;
  double base_z_mm;
  double fibre_endo_deg;  ///< 0 where the study has measured fibres instead
  double fibre_epi_deg;
  std::array<int, 3> mesh;                  ///< elements: circumferential, longitudinal, transmural
  std::string ends;                         ///< "fixed", or "sprung"
  std::optional<EndSprings> end_springs{};  ///< given if the ends are sprung
};

/// Any body: a mesh file (docs/mesh-file.md) that names its faces. Kind "mesh", or "fitted-lv" for a ventricle.
struct MeshSpecimen {
  std::filesystem::path file;
  std::string ends;                         ///< of the faces bottom and top: "fixed", or "sprung"
  std::optional<EndSprings> end_springs{};  ///< given if the ends are sprung
};

/// The specimen's shape is that of an image, in which a cavity pressure already pressed on it: imaged_at_kPa, imaged_at_sigma_kPa.
struct ImagedLoad {
  double pressure_kPa;
  double sigma_kPa = 0.0;  ///< standard deviation of the measured pressure; 0: exactly known
};

/// One alternative per `specimen.kind`; a new kind adds its struct here and its reader in study.cpp.
using Specimen = std::variant<AnnulusSpecimen, EllipsoidSpecimen, MeshSpecimen>;

/// Elements in the three directions; empty for a mesh file.
std::vector<int> mesh_of(const Specimen& specimen);

enum class Variation {
  whole,    ///< one value for the specimen
  element,  ///< one value an element
};

/// How alike neighbouring elements' values are taken to be (estimator/fit/smoothness.hpp).
struct Smoothness {
  enum class Kind { evidence, given, none };
  Kind kind = Kind::evidence;
  double step = 0;  ///< if given: the usual relative difference between neighbours, > 0
};

/// A material parameter that is to be estimated. Invariant: lower <= start <= upper, lower < upper.
struct StudyParameter {
  std::string name;  ///< with its unit, as "C1_kPa"
  double start;
  double lower;
  double upper;
  Variation vary;
  Smoothness smoothness = {};  ///< of a parameter that varies by element
};

struct StudyLaw {
  std::string name;  ///< "neo-hookean", known or not where the model is built; its path if `file` is given
  std::vector<StudyParameter> parameters;
  std::optional<std::filesystem::path> file = {};  ///< the user's own law (estimator/materials/file_law.hpp)
};

/// [images.to_specimen]: x_patient = origin + X x_axis + Y y_axis + Z z_axis, in DICOM's patient coordinates.
struct StudyPose {
  std::array<double, 3> origin_mm;
  std::array<std::array<double, 3>, 3> axes;  ///< x_axis, y_axis, z_axis: of length 1 and at right angles
};

/// Paths are resolved against the study file's folder; they need not exist until they are read.
struct StudyData {
  std::vector<std::filesystem::path> runs;
  std::vector<std::filesystem::path> reference =
      {};  ///< studies of this rig with nothing wrong, or one file made of them
  std::optional<std::filesystem::path> tags;
  std::optional<std::filesystem::path> points;
  std::optional<std::filesystem::path> frames;
  std::optional<std::filesystem::path> images = {};  ///< a scanner's export, of which tags are made
  std::optional<StudyPose> to_specimen = {};  ///< absent: a pose file beside the images, or their outlines
  std::optional<double> tag_spacing_mm = {};  ///< that the protocol of `images` has
};

/// [model.error]: what the rig's model gets wrong by itself, in per cent of a channel's range. Absent: rig_fit/model_error.hpp.
struct StudyModelError {
  std::optional<double> cavity_percent = {};
  std::optional<double> pump_percent = {};
  std::optional<double> volume_percent = {};
};

/// A chamber filled with fluid around the specimen (estimator/fe/chamber.hpp).
struct StudyChamber {
  double sealing_pressure_kPa = 0.0;                 ///< in it at the specimen's undeformed shape
  std::optional<double> compliance_mL_per_kPa = {};  ///< absent: open, of constant pressure
};

/// How the material answers to a change of volume (estimator/fe/element_mechanics.hpp).
struct StudyCompression {
  std::optional<double> bulk_modulus_kPa = {};  ///< absent: incompressible
  double volume_stiffness_kPa = 0.0;            ///< helps an incompressible solution to converge
};

/// A moment of a run at which an effect happened.
struct StudyMoment {
  std::string run;  ///< "baseline"
  double time_s;
};

/// What the study states of one of its effects: [model.parameters.ID.NAME] and [[model.moments.ID]]. Whether id and
/// names are known is decided where the model is built.
struct StudyEffect {
  std::string id;
  std::map<std::string, double> starts;  ///< by parameter
  std::vector<StudyMoment> moments;
};

struct Study {
  std::filesystem::path file;
  Specimen specimen;
  /// Measured fibre directions at points, in the images' coordinates (estimator/io/fibre_points.hpp): they replace those of the specimen.
  std::optional<std::filesystem::path> fibres = {};
  std::optional<ImagedLoad> imaged_at = {};  ///< absent: the specimen's shape is free of stress
  StudyLaw law;
  StudyData data;
  std::vector<std::string> effects;                      ///< effects that the model already includes
  std::vector<StudyEffect> effect_values = {};           ///< of some or all of them
  std::vector<std::filesystem::path> effect_files = {};  ///< the user's own effects
  StudyModelError model_error = {};
  std::optional<StudyChamber> chamber = {};
  StudyCompression compression = {};
  /// How often the specimen's elements are halved along each direction: a finer mesh of the very same body
  /// (estimator/mesh/refinement.hpp), while another number of elements approximates the specimen anew.
  std::array<int, 3> refine = {};
};

/// Throws InputError (file, line, key, value, remedy) for anything that the format does not know, a value out
/// of its range, a start outside its bounds, or tags/points without frames.
Study read_study(const std::filesystem::path& path);

/// The study file and every file that it names: what a command must not overwrite.
std::vector<std::filesystem::path> inputs_of(const Study& study);

/// `--set C1_kPa=7.5`: another start value. Throws InputError if the parameter is unknown or out of its
/// bounds.
void set_start(Study& study, std::string_view assignment);

/// `--smooth evidence`, `none` or the usual relative difference between neighbouring elements, as 0.05, for every
/// parameter. Throws InputError for anything else.
void set_smoothness(Study& study, std::string_view choice);

/// `--refine 0,1,1`: further halvings. Throws InputError unless three whole numbers from 0 to 4.
void set_refinement(Study& study, std::string_view halvings);

/// `--mesh 8,8,4`: another number of elements. Throws InputError unless three positive integers in range,
/// or if the mesh comes from a file.
void set_mesh(Study& study, std::string_view counts);

}  // namespace diastole
