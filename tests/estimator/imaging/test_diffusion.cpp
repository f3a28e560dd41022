// Diffusion series of a known ventricle back to tensors, outliers, gradient axes and the fibre field.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <sstream>

#include "estimator/imaging/diffusion/fibre_session.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/placed_mesh.hpp"
#include "tests/estimator/imaging/diffusion_scan.hpp"
#include "tests/estimator/imaging/finding_ids.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::imaging {
namespace {

using test::DiffusionScan;
using test::DiffusionTags;
using test::ScratchFolder;
using testing::AllOf;
using testing::HasSubstr;

constexpr double degree = std::numbers::pi / 180;

Eigen::Matrix3d oblique() {
  return (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

HermiteMesh wall_of(const DiffusionScan& scan) {
  const EllipsoidShape shape{.elements = {8, 4, 2}};
  return placed(make_ellipsoid(shape), {scan.axes, scan.origin_mm});
}

DiffusionSeries read(const DiffusionScan& scan) {
  const ScratchFolder folder;
  test::write_dicom(scan, folder.path());
  return read_diffusion(folder.path());
}

FibreSession measured(const DiffusionScan& scan, const FibreSessionRequest& request = {},
                      bool with_wall = true) {
  const ScratchFolder folder;
  test::write_dicom(scan, folder.path());
  FibreSessionRequest with_folder = request;
  with_folder.folder = folder.path();
  return measure_fibres(with_folder, with_wall ? std::optional(wall_of(scan)) : std::nullopt);
}

/// Over the rows, degrees; the apex, where the circumference turns within a voxel, does not count.
double rms_error_deg(const FibreSession& session, const DiffusionScan& scan) {
  double squares = 0, count = 0;
  for (const FibrePointRow& row : session.rows) {
    const Eigen::Vector3d place(row.place_mm.data()), direction(row.direction.data());
    const auto truth = scan.fibre(place);
    if (!truth || (scan.axes.transpose() * (place - scan.origin_mm)).z() < -42) continue;
    squares += std::pow(std::acos(std::min(1.0, std::abs(truth->dot(direction)))) / degree, 2);
    count += 1;
  }
  return std::sqrt(squares / count);
}

/// Voxels with one material only: their tensors are those that were put in.
void expect_tensors(const DiffusionSeries& series, const DiffusionScan& scan, double within) {
  size_t compared = 0;
  for (const VoxelTensor& voxel : fit_tensors(series).voxels) {
    if (!scan.isotropic) continue;
    if (std::abs(voxel.s0 - 1000 * 16) > 20) continue;
    EXPECT_NEAR((matrix_of(voxel.tensor) - Eigen::Matrix3d::Identity()).norm(), 0, within);
    ++compared;
  }
  EXPECT_GT(compared, 300U);
}

TEST(Diffusion, ReadsEveryWayInWhichHeadersSayWeightings) {
  for (const DiffusionTags tags :
       {DiffusionTags::standard, DiffusionTags::b_matrix, DiffusionTags::siemens}) {
    DiffusionScan scan{.tags = tags, .isotropic = true};
    scan.axes = oblique();
    const DiffusionSeries series = read(scan);
    EXPECT_EQ(series.volumes.size(), 14U);
    EXPECT_EQ(series.directions().size(), 12U);
    EXPECT_EQ(series.b_values(), (std::vector<double>{0, 1000}));
    EXPECT_EQ(series.slices.size(), 12U);
    EXPECT_TRUE(series.findings.empty());
    // Stored values are rounded to 1/16.
    expect_tensors(series, scan, 2e-3);
  }
}

TEST(Diffusion, NiftiIsTheSameSeries) {
  DiffusionScan scan;
  scan.axes = oblique();
  const ScratchFolder nifti;
  test::write_nifti(scan, nifti.path());
  const TensorImage a = fit_tensors(read_diffusion(nifti.path()));
  const TensorImage b = fit_tensors(read(scan));
  ASSERT_FALSE(a.voxels.empty());
  size_t compared = 0;
  for (const VoxelTensor& one : a.voxels) {
    for (const VoxelTensor& other : b.voxels) {
      if (one.s0 < 900 || one.slice != other.slice || one.row != other.row || one.column != other.column)
        continue;
      EXPECT_LT((one.place_mm - other.place_mm).norm(), 1e-3);
      EXPECT_LT((one.tensor - other.tensor).norm(), 5e-3);
      ++compared;
    }
  }
  EXPECT_GT(compared, 300U);
}

/// DIPY's WLS, by the normal equations.
TEST(Diffusion, WeightsAreThoseOfTheUnweightedFit) {
  DiffusionSeries series;
  for (const auto& [b, g] : DiffusionScan().volumes()) {
    DiffusionVolume volume;
    volume.b_matrix = b * g * g.transpose();
    volume.images.resize(1);
    series.volumes.push_back(volume);
  }
  series.slices.resize(1);
  std::vector<size_t> all(series.volumes.size());
  for (size_t i = 0; i < all.size(); ++i)
    all[i] = i;
  const TensorDesign design = tensor_design(series, all);
  Eigen::VectorXd signals(design.rows());
  for (Eigen::Index i = 0; i < signals.size(); ++i)
    signals[i] = 500 - 20.0 * static_cast<double>(i) + 13.0 * static_cast<double>(i % 3);
  const TensorSolution fit = TensorSolver(design).solve(signals);
  const Eigen::VectorXd logs = signals.array().log();
  const Eigen::VectorXd first = (design.transpose() * design).ldlt().solve(design.transpose() * logs);
  const Eigen::VectorXd weight = (2 * (design * first).array()).exp();
  const Eigen::VectorXd second = (design.transpose() * weight.asDiagonal() * design)
                                     .ldlt()
                                     .solve(design.transpose() * weight.asDiagonal() * logs);
  EXPECT_LT((fit.unknowns - second).cwiseAbs().maxCoeff(), 1e-9);
  const Eigen::MatrixXd covariance = (design.transpose() * weight.asDiagonal() * design).inverse();
  EXPECT_LT((fit.covariance - covariance).norm(), 1e-9 * covariance.norm());
}

TEST(Diffusion, TensorsAreDipys) {
  const ScratchFolder folder;
  test::write_nifti({.noise = 50}, folder.path());
  folder.write("tensors.csv", tensor_file_text(fit_tensors(read_diffusion(folder.path()))));
  const std::string out = (folder.path() / "out.txt").string();
  const int status = std::system(
      fmt::format("/usr/bin/python3 {}/tests/estimator/imaging/dipy_tensors.py {} {}/tensors.csv > {} 2>&1",
                  DIASTOLE_SOURCE_DIR, folder.path().string(), folder.path().string(), out)
          .c_str());
  std::ifstream input(out);
  std::stringstream text;
  text << input.rdbuf();
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "python3-dipy is not installed: " << text.str();
  ASSERT_EQ(WEXITSTATUS(status), 0) << text.str();
  double largest = 1;
  size_t voxels = 0;
  text >> largest >> voxels;
  EXPECT_LT(largest, 1e-9);
  EXPECT_GT(voxels, 1000U);
}

TEST(Diffusion, FibresOfAnObliqueVentricle) {
  DiffusionScan scan{.noise = 50};  // SNR 20
  scan.axes = oblique();
  const FibreSession session = measured(scan);
  ASSERT_TRUE(session.field);
  EXPECT_TRUE(session.field->converged);
  EXPECT_LT(rms_error_deg(session, scan), 2.0);
  EXPECT_TRUE(session.outliers.empty());
  EXPECT_FALSE(session.axes->is_wrong);
  EXPECT_TRUE(session.findings.empty());
  EXPECT_NEAR(session.snr, 20, 3);
}

TEST(Diffusion, FlippedGradientsAreFoundAndUndone) {
  for (const Eigen::Vector3d& signs : {Eigen::Vector3d(-1, 1, 1), Eigen::Vector3d(1, -1, 1)}) {
    DiffusionScan scan{.noise = 50, .header_signs = signs};
    const FibreSession session = measured(scan);
    ASSERT_TRUE(session.axes);
    EXPECT_TRUE(session.axes->is_wrong);
    EXPECT_LT(rms_error_deg(session, scan), 2.0);
    EXPECT_THAT(session.findings.at(0).what, HasSubstr("contradict"));
  }
}

TEST(Diffusion, AFlipAlongTheLongAxisIsToldByTheHelixsHand) {
  const FibreSession session = measured({.noise = 50, .header_signs = {1, 1, -1}});
  EXPECT_FALSE(session.axes->is_wrong);
  ASSERT_FALSE(session.findings.empty());
  EXPECT_EQ(session.findings[0].id, "helix-hand");
  const DiffusionScan scan{.noise = 50, .header_signs = {1, 1, -1}};
  const FibreSession undone = measured(scan, {.folder = {}, .axes = axis_change_named("z")});
  EXPECT_LT(rms_error_deg(undone, scan), 2.0);
}

TEST(Diffusion, ATurnedTableIsFoundAndUndone) {
  DiffusionScan scan{.noise = 50};
  scan.axes = oblique();
  const Eigen::Vector3d across = scan.axes * Eigen::Vector3d(0.8, 0.6, 0);
  scan.header_turn = Eigen::AngleAxisd(-15 * degree, across).toRotationMatrix();
  const FibreSession session = measured(scan);
  ASSERT_TRUE(session.axes);
  EXPECT_TRUE(session.axes->is_wrong);
  ASSERT_FALSE(session.findings.empty());
  EXPECT_EQ(session.findings[0].id, "gradient-turn");
  EXPECT_NEAR(session.findings[0].number, 15, 2);
  EXPECT_LT(rms_error_deg(session, scan), 2.5);
}

TEST(Diffusion, AHelixThatVariesAroundTheWallIsNoTurnedTable) {
  DiffusionScan scan{.noise = 50, .helix_around_deg = 15};
  scan.axes = oblique();
  EXPECT_TRUE(measured(scan).findings.empty());
}

/// Fibres that leave the wall by one angle everywhere would look the same.
TEST(Diffusion, ATurnAboutTheLongAxisIsToldAndLeft) {
  DiffusionScan scan{.noise = 50};
  scan.header_turn = Eigen::AngleAxisd(20 * degree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const FibreSession session = measured(scan);
  EXPECT_FALSE(session.axes->is_wrong);
  EXPECT_TRUE(session.axes->is_doubtful);
  ASSERT_FALSE(session.findings.empty());
  EXPECT_EQ(session.findings[0].id, "gradient-turn");
  EXPECT_THAT(session.findings[0].remedy, HasSubstr("Not corrected"));
}

TEST(Diffusion, ImagesThatLostSignalAreLeftOut) {
  DiffusionScan scan{.noise = 50};
  for (int slice = 0; slice < scan.slices; ++slice)
    scan.faded.insert({5, slice});
  scan.faded.insert({9, 3});
  const FibreSession session = measured(scan);
  EXPECT_EQ(session.outliers.size(), static_cast<size_t>(scan.slices) + 1);
  for (const SignalOutlier& outlier : session.outliers)
    EXPECT_NEAR(outlier.gain, 0.5, 0.1);
  EXPECT_LT(rms_error_deg(session, scan), 2.0);
  const FibreSession kept = measured(scan, {.folder = {}, .keep_outliers = true});
  EXPECT_TRUE(kept.outliers.empty());
  EXPECT_GT(kept.tensors.sigma, 1.2 * session.tensors.sigma);
}

/// Tissue's signal falls more slowly at large b than any tensor's: no image of such a shell is an outlier, one that lost signal still is.
TEST(Diffusion, AShellThatNoTensorExplainsIsToldAndKept) {
  DiffusionScan scan{.noise = 15, .second_shell = true, .kurtosis = 1.8};
  scan.faded = {{17, 3}};
  const FibreSession session = measured(scan);
  ASSERT_EQ(session.outliers.size(), 1U);
  EXPECT_EQ(session.outliers[0].volume, 17U);
  EXPECT_EQ(session.outliers[0].slice, 3U);
  EXPECT_THAT(test::ids_of(session.findings), testing::Contains("shell-misfit"));
}

TEST(Diffusion, AMissingImageIsNamed) {
  const FibreSession session = measured({.noise = 50, .missing = {{6, 4}}});
  ASSERT_FALSE(session.findings.empty());
  EXPECT_EQ(session.findings[0].id, "image-missing");
  EXPECT_THAT(session.findings[0].what, AllOf(HasSubstr("slice 5 of 12"), HasSubstr("b 1000 along")));
}

TEST(Diffusion, AnIsotropicMaterialIsToldByItsNoise) {
  const FibreSession session = measured({.noise = 50, .isotropic = true}, {}, false);
  ASSERT_FALSE(session.findings.empty());
  EXPECT_EQ(session.findings.back().id, "isotropic");
  EXPECT_NEAR(session.md, 1.0, 0.03);
  EXPECT_NEAR(session.fa, session.fa_of_noise, 0.3 * session.fa);
}

TEST(Diffusion, TheFactorTwoHalvesTensorsAlone) {
  const DiffusionScan scan{.noise = 50};
  const FibreSession plain = measured(scan), halved = measured(scan, {.folder = {}, .factor_two = true});
  EXPECT_NEAR(halved.md, 0.5 * plain.md, 1e-12);
  EXPECT_EQ(halved.rows[7].direction, plain.rows[7].direction);
}

TEST(Diffusion, RefusesWhatIsNoTensorScheme) {
  const auto refusal = [](const DiffusionScan& scan) { return test::message_of([&] { (void)read(scan); }); };
  EXPECT_THAT(refusal({.absent_volumes = {7, 8, 9, 10, 11, 12, 13}}),
              AllOf(HasSubstr("5 directions"), HasSubstr("6 of the 7")));
  EXPECT_THAT(refusal({.absent_volumes = {0, 1}}), HasSubstr("of the 7 numbers"));
  EXPECT_THAT(refusal({.tags = DiffusionTags::none}), HasSubstr("holds no diffusion series"));
}

TEST(Diffusion, RefusesNiftiWithoutOrWithOtherTables) {
  const ScratchFolder folder;
  test::write_nifti({}, folder.path());
  const auto refusal = [&] { return test::message_of([&] { (void)read_diffusion(folder.path()); }); };
  const auto image = folder.path() / "dwi.nii";
  std::filesystem::resize_file(image, std::filesystem::file_size(image) - 1000);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("dwi.nii"), HasSubstr("ends before")));
  std::ofstream(folder.path() / "dwi.bval") << "0 1000\n";
  EXPECT_FALSE(refusal().empty());
  std::filesystem::remove(folder.path() / "dwi.bvec");
  EXPECT_THAT(refusal(), HasSubstr("dwi.bvec"));
}

/// Tables as other programs write them beside the image.
class NiftiTables : public testing::Test {
 protected:
  NiftiTables() {
    scan.axes = oblique();
    test::write_nifti(scan, folder.path());
  }

  std::vector<std::vector<double>> rows(const char* file) const {
    std::ifstream text(folder.path() / file);
    std::vector<std::vector<double>> rows;
    for (std::string line; std::getline(text, line);) {
      std::istringstream words(line);
      rows.emplace_back(std::istream_iterator<double>(words), std::istream_iterator<double>());
    }
    return rows;
  }

  void write(const char* file, const std::vector<std::vector<double>>& rows) const {
    std::ofstream text(folder.path() / file);
    for (const std::vector<double>& row : rows)
      text << fmt::format("{:.6f}\n", fmt::join(row, " "));
  }

  FibreSession session() const { return measure_fibres({.folder = folder.path()}, wall_of(scan)); }

  const ScratchFolder folder;
  DiffusionScan scan{.noise = 50};
};

TEST_F(NiftiTables, InPatientAxesAreFoundAndUndone) {
  for (const double from_left : {1.0, -1.0}) {  // left, posterior, superior; right, anterior, superior
    std::vector<std::vector<double>> table(3);
    for (const auto& [b, g] : scan.volumes())
      for (int i = 0; i < 3; ++i)
        table[static_cast<size_t>(i)].push_back((i < 2 ? from_left : 1) * g[i]);
    write("dwi.bvec", table);
    const FibreSession found = session();
    EXPECT_TRUE(found.axes->is_wrong);
    EXPECT_THAT(found.axes->chosen.name, HasSubstr(from_left > 0 ? "left, posterior" : "right, anterior"));
    EXPECT_LT(rms_error_deg(found, scan), 2.0);
  }
}

/// Images and directions in another order.
TEST_F(NiftiTables, ThatNoChangeOfAxesMakesAgreeAreToldAsDoubtful) {
  std::vector<std::vector<double>> table = rows("dwi.bvec");
  const std::vector<std::vector<double>> right = table;
  for (size_t i = 0; i < 3; ++i)
    for (size_t v = 0; v < 12; ++v)
      table[i][2 + v] = right[i][2 + 5 * v % 12];
  write("dwi.bvec", table);
  const FibreSession found = session();
  EXPECT_FALSE(found.axes->is_wrong);
  EXPECT_TRUE(found.axes->is_doubtful);
  ASSERT_FALSE(found.findings.empty());
  EXPECT_EQ(found.findings[0].id, "gradient-axes-doubtful");
}

TEST_F(NiftiTables, DirectionsOfOtherLengthsWeightByTheirSquares) {
  const DiffusionSeries plain = read_diffusion(folder.path());
  std::vector<std::vector<double>> b = rows("dwi.bval"), table = rows("dwi.bvec");
  for (size_t v = 2; v < 14; v += 2) {
    b[0][v] *= 2;
    for (std::vector<double>& row : table)
      row[v] *= std::sqrt(0.5);
  }
  write("dwi.bval", b);
  write("dwi.bvec", table);
  const DiffusionSeries scaled = read_diffusion(folder.path());
  ASSERT_EQ(scaled.findings.size(), 1U);
  EXPECT_EQ(scaled.findings[0].id, "gradient-lengths");
  for (size_t v = 0; v < plain.volumes.size(); ++v)
    EXPECT_LT((scaled.volumes[v].b_matrix - plain.volumes[v].b_matrix).norm(), 0.01);
}

TEST_F(NiftiTables, BValuesInOtherUnitsAreRefused) {
  std::vector<std::vector<double>> b = rows("dwi.bval");
  for (double& value : b[0])
    value *= 0.7e-3;
  write("dwi.bval", b);
  EXPECT_THAT(test::message_of([&] { (void)read_diffusion(folder.path()); }),
              AllOf(HasSubstr("largest b value is 0.7"), HasSubstr("700 s/mm")));
}

TEST_F(NiftiTables, ADirectionThatIsNoNumberIsReadWhereNothingIsWeighted) {
  std::vector<std::vector<double>> table = rows("dwi.bvec");
  for (std::vector<double>& row : table)
    row[0] = row[1] = std::nan("");
  write("dwi.bvec", table);
  EXPECT_EQ(read_diffusion(folder.path()).volumes[1].b_s_mm2(), 0);
  table[2][5] = std::nan("");
  write("dwi.bvec", table);
  EXPECT_THAT(test::message_of([&] { (void)read_diffusion(folder.path()); }), HasSubstr("volume 6"));
}

/// Slices across a part of the ventricle measure that part.
TEST(Diffusion, AFieldThatIsMostlyContinuedSaysSo) {
  const FibreSession few = measured({.slices = 3, .noise = 50});
  EXPECT_THAT(test::ids_of(few.findings), testing::Contains("fibres-continued"));
}

TEST(Diffusion, AMeshElsewhereIsRefused) {
  DiffusionScan scan{.noise = 50};
  const ScratchFolder folder;
  test::write_dicom(scan, folder.path());
  scan.origin_mm += Eigen::Vector3d(300, 0, 0);
  EXPECT_THAT(test::message_of([&] { (void)measure_fibres({.folder = folder.path()}, wall_of(scan)); }),
              AllOf(HasSubstr("0 voxels"), HasSubstr("patient coordinates")));
}

TEST(Diffusion, AxisChangesByName) {
  EXPECT_EQ(axis_change_named("x")->change(0, 0), -1);
  EXPECT_EQ(axis_change_named("-y+x+z")->change,
            (Eigen::Matrix3d() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished());
  EXPECT_TRUE(axis_change_named("as-said")->change.isIdentity());
  for (const char* wrong : {"", "w", "+x+x+z", "xyz", "+x+y+q"})
    EXPECT_FALSE(axis_change_named(wrong)) << wrong;
}

}  // namespace
}  // namespace diastole::imaging
