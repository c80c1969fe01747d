#pragma once
// A PID controller with clamped integral and output, and four anti-windup strategies. Behaves as
// ros-controls' control_toolbox::Pid. Units: error in any unit u (rad, m, rad/s ...), output in any unit c; p
// in c/u. Source: K. J. Astroem, T. Haegglund, "Advanced PID Control" (2006), section 3.5.

#include <limits>
#include <string>

#include "doppel/base/core/status.h"
#include "doppel/control/controllers/detail/controller_parameters.h"

namespace doppel {

struct PidGains {
  double p = 0, i = 0, d = 0;
  double i_clamp_max =
      std::numeric_limits<double>::infinity();  // of the integral term, in units of the output
  double i_clamp_min = -std::numeric_limits<double>::infinity();
  double u_clamp_max = std::numeric_limits<double>::infinity();  // of the output
  double u_clamp_min = -std::numeric_limits<double>::infinity();
  // "legacy" integrates before it computes the output. The others integrate afterwards: "none" always,
  // "conditional_integration" not while the error drives a saturated output further out, "back_calculation"
  // reduces the integral by the part of the output that was clamped.
  std::string antiwindup_strategy = "legacy";
  double tracking_time_constant = 0;  // s, of back_calculation; 0: sqrt(d / i), or p / i without d
  double error_deadband = 0;          // no integration while |error| is not above it
};

// The numbers among the gains as parameters, "gains.JOINT.p". `times`: rules of the time constant and the
// deadband.
ControllerParameters gain_parameters(PidGains& gains, const std::string& prefix,
                                     const ParameterOptions& times = {});

// Refuses with the reason why these gains cannot be used, with the gain and the fix.
Status check_gains(const PidGains& gains);

// The values that a PID controller remembers from update to update, in units of its output.
struct PidMemory {
  double integral = 0, output = 0;
};

class Pid {
 public:
  // Between steps. Precondition: check_gains(gains) is ok. The integral is kept.
  void set_gains(const PidGains& gains);
  // Sets the integral and the last output to zero.
  void reset();
  // In the loop. error = target - state. With dt_s <= 0 nothing changes and the last output is returned; with
  // an error that is not finite the result is NaN and the integral is kept.
  double compute(double error, double error_dot, double dt_s);

  [[nodiscard]] double integral() const { return memory_.integral; }  // the term, in units of the output
  // Between steps. The gains are not part of it.
  [[nodiscard]] const PidMemory& memory() const { return memory_; }
  void set_memory(const PidMemory& memory) { memory_ = memory; }

 private:
  enum class AntiWindup { legacy, back_calculation, conditional_integration, none };
  [[nodiscard]] double integral_rate(double error, double free, double put_out) const;

  PidGains gains_;
  AntiWindup antiwindup_ = AntiWindup::legacy;
  double tracking_time_ = 0;  // s; 0: no back calculation
  PidMemory memory_;
};

}  // namespace doppel
