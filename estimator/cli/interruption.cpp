#include "estimator/cli/interruption.hpp"

#include <csignal>

namespace diastole {
namespace {

volatile std::sig_atomic_t came = 0;

}  // namespace

Interruption::Interruption() {
  came = 0;
  before_ = std::signal(SIGINT, [](int) {
    came = 1;
    std::signal(SIGINT, SIG_DFL);
  });
}

Interruption::~Interruption() { std::signal(SIGINT, before_); }

bool Interruption::requested() { return came != 0; }

}  // namespace diastole
