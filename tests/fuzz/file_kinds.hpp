#pragma once
// What fuzz_files reads; the numbers stand in its corpus, so new ones go to the end.

namespace diastole::fuzz {

enum class FileKind : unsigned char {
  rig,
  experiment,
  waveform,
  study,
  frame_table,
  tag_table,
  point_table,
  fibre_table,
  mesh,
  exfiles,  ///< exnode, form feed, exelem
  effect,
  law,
  fit,
  tracking,
  flow,
  gmsh,
  vtu,
  xdmf,
  update,
  key,
  elf,
  guide,       ///< a table, or a GPFile
  bench_test,  ///< of tissue
  nifti,       ///< image, form feed, bval, form feed, bvec
  edits,       ///< of tagged images, made by hand
  pose,
  reference,  ///< of a rig
  count
};

}  // namespace diastole::fuzz
