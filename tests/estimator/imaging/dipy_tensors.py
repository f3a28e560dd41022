"""Compares a tensor file with DIPY's weighted least squares of the same NIfTI series.

dipy_tensors.py FOLDER TENSORS.csv     prints the largest difference (1e-3 mm^2/s) and the number of voxels
Exit code 77 without DIPY (Debian: python3-dipy).
"""
import sys

try:
    import numpy as np
    import nibabel
    from dipy.core.gradients import gradient_table
    from dipy.reconst.dti import TensorModel
except ImportError as missing:
    print(missing)
    sys.exit(77)

folder, tensors = sys.argv[1:]
image = nibabel.load(folder + "/dwi.nii")
data = np.asarray(image.dataobj, dtype=float)
b = np.loadtxt(folder + "/dwi.bval")
directions = np.loadtxt(folder + "/dwi.bvec").T
directions[:, 0] *= -1  # FSL's convention; the image's axes are LPS
table = gradient_table(b, directions, b0_threshold=50)
model = TensorModel(table, fit_method="WLS", min_signal=1e-6)

rows = np.loadtxt(tensors, delimiter=",", skiprows=1)
ras = rows[:, :3] * [-1, -1, 1]
voxels = np.rint(nibabel.affines.apply_affine(np.linalg.inv(image.affine), ras)).astype(int)
lower = model.fit(data[tuple(voxels.T)]).lower_triangular() * 1e3  # xx, xy, yy, xz, yz, zz
theirs = lower[:, [0, 1, 3, 2, 4, 5]]
print(np.abs(theirs - rows[:, 3:]).max(), len(rows))
