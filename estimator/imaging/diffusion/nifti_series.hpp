#pragma once
// Diffusion series as NIfTI: NAME.nii or NAME.nii.gz with NAME.bval and NAME.bvec (FSL's layout, as dcm2niix writes).
//
// A .bvec has directions in the image's axes, x reversed if the voxel-to-patient map has a positive determinant (FSL's convention);
// A direction whose length is not 1 weights by b |g|²; one of an image without weighting may be nan.
// NIfTI's patient coordinates are right, anterior, superior, ours left, posterior, superior (LPS).

#include <filesystem>
#include <optional>

#include "estimator/imaging/diffusion/diffusion_series.hpp"

namespace diastole::imaging {

struct NiftiFiles {
  std::filesystem::path image, bval, bvec;
};

/// The folder's NIfTI image if it has one. Throws InputError for several, or one without .bval or .bvec.
std::optional<NiftiFiles> nifti_files(const std::filesystem::path& folder);

/// Throws InputError (file, place, value, remedy) for what is truncated, tables of another length, values that are no numbers.
DiffusionSeries read_nifti(const NiftiFiles& files);

}  // namespace diastole::imaging
