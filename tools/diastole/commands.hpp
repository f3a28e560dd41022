#pragma once
// The front door's own commands.

#include <memory>

#include "protocol/contract/command.hpp"

namespace diastole {

class SessionSeries;

/// `diastole batch`: fit, explain, montecarlo or track on many studies.
void add_batch(CommandLine& line);
/// `diastole catheter`: the paper's test of catheter and transducer, from a recorded step of pressure.
void add_catheter(CommandLine& line);
/// `diastole compare`: what distinguishes runs.
void add_compare(CommandLine& line);
/// `diastole desk`: look at and correct tracking and contours in a browser.
void add_desk(CommandLine& line);
/// `diastole replay`: a recorded run once more, through simulated instrument, the real firmware and the real daemon.
void add_replay(CommandLine& line);
/// `diastole runs`: a catalogue of runs and of what was made of them.
void add_runs(CommandLine& line);
/// `diastole scan`: a simulated scanner, DICOM of a study's motion.
void add_scan(CommandLine& line);
/// `diastole shape`: the drive by which the specimen follows a wanted curve.
void add_shape(CommandLine& line);
/// What `run --shape` and `simulate --shape` do; one for each command.
std::shared_ptr<SessionSeries> make_shape_series();
/// `diastole simulate`: a whole session without hardware, through the real daemon, or a series of them.
void add_simulate(CommandLine& line, std::shared_ptr<SessionSeries> series);

}  // namespace diastole
