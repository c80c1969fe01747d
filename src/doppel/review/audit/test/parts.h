#pragma once
// Pieces of a description that tests of rules insert into the valid one of audit_fixture.h.

#include <string>

#include "doppel/review/audit/test/audit_fixture.h"

namespace doppel::audit_test {

inline constexpr Severity E = Severity::error, W = Severity::warning, N = Severity::note;

inline Parts with(std::string Parts::*part, std::string text) {
  Parts out;
  out.*part = std::move(text);
  return out;
}

inline std::string tensor(const std::string& six, const std::string& mass = "1",
                          const std::string& com = "0 0 0.1") {
  std::string out = "<inertial><origin xyz=\"" + com + "\"/><mass value=\"" + mass + "\"/><inertia";
  constexpr const char* names[] = {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};
  std::size_t begin = 0;
  for (const char* name : names) {
    const std::size_t end = std::min(six.find(' ', begin), six.size());
    out += std::string(" ") + name + "=\"" + six.substr(begin, end - begin) + "\"";
    begin = end + 1;
  }
  return out + "/></inertial>";
}

inline std::string limit(const std::string& lower, const std::string& upper, const std::string& effort = "5",
                         const std::string& velocity = "3") {
  return "<limit lower=\"" + lower + "\" upper=\"" + upper + "\" effort=\"" + effort + "\" velocity=\"" +
         velocity + "\"/>";
}

// A second link on a joint 'k' with the given content.
inline std::string follower(const std::string& inside, const std::string& name = "tip",
                            const std::string& inertial = kInertial, const std::string& joint = "k") {
  return "<link name=\"" + name + "\">" + inertial + kVisual + kCollision + "</link>\n<joint name=\"" +
         joint + "\" type=\"revolute\"><origin xyz=\"0.4 0 0\"/><parent link=\"arm\"/><child link=\"" + name +
         "\"/>" + kAxis + inside + "</joint>";
}

// The same of 'j' and of a second joint 'k'.
inline Parts two_ranges(const std::string& lower, const std::string& upper, const std::string& lower_k,
                        const std::string& upper_k) {
  Parts p = with(&Parts::limit, limit(lower, upper));
  p.more = follower(limit(lower_k, upper_k));
  return p;
}

inline std::string shape_with(const std::string& shape) {
  return R"(<origin xyz="0 0 0.1"/><geometry>)" + shape + "</geometry>";
}

}  // namespace doppel::audit_test
