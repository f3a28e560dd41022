#pragma once
// NAME.batch.toml: commands on many studies.
//
//   format = "diastole-batch"
//   version = 1
//   output = "results"                     # a folder; beside this file, as all paths here
//
//   [[job]]
//   command = "fit"                        # fit, explain, montecarlo or track
//   inputs = ["gels/*.study.toml"]         # studies, or image folders for track; * and ? as in a shell
//   arguments = ["--mesh", "8,4,1"]       # files in them count from this file's folder as well, where the job runs
//
// One job is one command on one input. Its number, from 1, is its place in the file; its name is the command's and the input's,
// "fit-gel-7", with a number after it where several would have the same.

#include <filesystem>
#include <string>
#include <vector>

namespace diastole::batch {

struct Job {
  std::string name;
  std::string command;
  std::filesystem::path input;
  std::vector<std::string> arguments;  ///< of `diastole`, from the command's name on, with outputs of its own
};

struct Batch {
  std::filesystem::path file;
  std::filesystem::path output;
  std::vector<Job> jobs;  ///< one or more
};

/// Throws InputError for what is no such file, an unknown command, an input that is not there, an argument that is set here
/// (-o, --json), that prints help instead, or that names one output file for several jobs.
Batch read_batch(const std::filesystem::path& file);

}  // namespace diastole::batch
