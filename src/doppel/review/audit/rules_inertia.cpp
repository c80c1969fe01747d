// Masses and tensors by themselves. With the shapes: rules_inertia_shape.cpp; twins: rules_twins.cpp.
#include <algorithm>
#include <cmath>
#include <set>

#include "doppel/review/audit/detail/inertia_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr double kDummy = 1e-5;          // kg: a link that stands for a frame
constexpr double kNothing = 1e-12;       // kg m^2
constexpr double kRounding = 1e-6;       // of the largest moment
constexpr double kFewUnits = 2e-5;       // kg m^2: where six decimals leave two digits
constexpr double kRoundedExcess = 0.01;  // of the largest moment: digits were lost
constexpr double kWrongExcess = 0.3;     // below this, balancing the tensor hardly changes the simulation
constexpr double kNoExcess = 1e-6;
constexpr double kOneOutOfThree = 1e-9;  // of the largest moment: an off-diagonal that counts as 0

std::string shown(const Eigen::Vector3d& moments) {
  return fmt::format("{:.3g}, {:.3g}, {:.3g}", moments[0], moments[1], moments[2]);
}

Operation compute(const Link& link, std::string why) {
  Operation out;
  out.action = ComputeInertia{link.name, {}, {}};
  out.why = std::move(why);
  return out;
}

// The severity of a fault in one link's tensor: engines use the sum over links that are fixed to each other.
Severity graded(const Link& link, const Body& body, Severity alone) {
  if (link.inertial->mass <= kDummy) return Severity::note;
  const bool others = body.links.size() > 1 && body.mass.mass > link.inertial->mass;
  const Eigen::Matrix3d& I = body.mass.I;
  const bool carried = others && possible({I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)});
  return carried || body.joint == nullptr ? std::min(alone, Severity::warning) : alone;
}

// Diagonal moments of exactly zero beside others that are positive, as exporters with few
// decimals write them.
bool rounded(const Components& c) {
  double largest = 0;
  int zeros = 0;
  for (const std::size_t i : kDiagonal) {
    if (c[i] < 0) return false;
    zeros += c[i] == 0 ? 1 : 0;
    largest = std::max(largest, c[i]);
  }
  const double off = std::max({std::abs(c[1]), std::abs(c[2]), std::abs(c[4])});
  return zeros > 0 && zeros < 3 && off <= kOneOutOfThree * largest;
}

// The zero is the smallest moment of the three, so the next one is its upper bound.
Components with_transverse(const Components& c) {
  double smallest = 0, largest = 0;
  for (const std::size_t i : kDiagonal) {
    if (c[i] > 0) smallest = smallest == 0 ? c[i] : std::min(smallest, c[i]);
    largest = std::max(largest, c[i]);
  }
  Components out = c;
  const double value = largest <= 2 * smallest ? smallest : largest;
  for (const std::size_t i : kDiagonal) {
    if (out[i] == 0) out[i] = value;
  }
  return out;
}

// Six decimals were written, and the others are a few units of the last one.
bool few_digits(const Components& c) {
  double largest = 0;
  for (const std::size_t i : kDiagonal) largest = std::max(largest, c[i]);
  return largest <= kFewUnits;
}

void report_rounded(const std::vector<const Link*>& links, Severity severity, Findings& out) {
  if (links.empty()) return;
  std::vector<std::string> entries;
  std::vector<Operation> repair;
  for (const Link* link : links) {
    const Components c = components_of(*link->inertial);
    for (const std::size_t i : kDiagonal) {
      if (c[i] == 0) entries.push_back(fmt::format("{}.{}", link->name, kComponentNames[i]));
    }
    repair.push_back(set_components(
        link->name, c, with_transverse(c),
        "rounded to zero by the exporter; the transverse moment is an upper bound, not a measurement"));
  }
  Finding& f =
      out.add("inertia.rounded_zero", severity,
              links.size() == 1 ? subject(*links.front()) : fmt::format("{} links", links.size()),
              links.front()->inertial->source,
              fmt::format("{} of inertia {} exactly zero: {}",
                          entries.size() == 1 ? "a moment" : fmt::format("{} moments", entries.size()),
                          entries.size() == 1 ? "is" : "are", fmt::join(entries, ", ")),
              "set each to the link's transverse moment, which is an upper bound and not a measurement; for "
              "a heavy link export the tensor again with more digits");
  if (severity == Severity::error) f.repair = std::move(repair);
}

bool identity(const Components& c) {
  return c == Components{1, 0, 0, 1, 0, 1};
}

void report_identity(const Link& link, const std::optional<LinkShape>& shape, Findings& out) {
  const Inertial& inertial = *link.inertial;
  const double reach = shape ? shape->size() : 2.0;
  const bool lies = inertial.mass > 0 && std::sqrt(1.0 / inertial.mass) > reach;
  Finding& f = out.add(
      "inertia.identity", subject(link), inertial.source,
      fmt::format("its tensor is the identity, 1 kg m^2 about every axis, at {:g} kg", inertial.mass));
  if (lies && computable(link, shape)) f.repair = {compute(link, "the identity was a placeholder")};
}

// Zero except for rounding: the tensor of a rod or a sheet, or one that was never filled in.
void report_singular(const Link& link, const Body& body, const Eigen::Vector3d& moments, Findings& out) {
  out.add("inertia.not_positive", std::min(graded(link, body, Severity::warning), Severity::warning),
          subject(link), link.inertial->source,
          fmt::format("its principal moments are {} kg m^2: the smallest is zero within rounding",
                      shown(moments)),
          "nothing, if the link represents a frame; otherwise compute it from the link's shape and mass");
}

void report_impossible(const Link& link, const Body& body, const Components& c,
                       const std::optional<LinkShape>& shape, Findings& out) {
  const Eigen::Vector3d moments = principal_moments(c);
  const bool positive = moments[0] > 0;
  if (!positive && moments[0] >= -kRounding * moments[2]) return report_singular(link, body, moments, out);
  const double excess = triangle_excess(moments);
  const bool rounding = positive && excess <= kRoundedExcess;
  // Without a shape to compare it with, a suitable power of ten is a guess.
  const auto typo = rounding || !computable(link, shape) ? std::nullopt : only_typo(c, *link.inertial, shape);
  std::string fix = typo ? fmt::format("correct {}: no other single change makes it valid", typo->what) : "";
  const bool wrong = !positive || excess > kWrongExcess;
  const Severity severity = graded(link, body, wrong ? Severity::error : Severity::warning);
  Finding& f =
      positive ? out.add("inertia.triangle", severity, subject(link), link.inertial->source,
                         fmt::format("the principal moments {} kg m^2 are physically impossible: the largest "
                                     "exceeds the sum of the others by {:.2g} %",
                                     shown(moments), 100 * excess),
                         fix)
               : out.add("inertia.not_positive", severity, subject(link), link.inertial->source,
                         fmt::format("its principal moments are {} kg m^2, and none may be zero or negative",
                                     shown(moments)),
                         fix);
  if (severity != Severity::error) return;
  if (typo) {
    f.repair = {set_components(link.name, c, typo->corrected, typo->what)};
  } else if (computable(link, shape)) {
    f.repair = {compute(link, "the tensor is physically impossible")};
    f.fix = "compute it from the link's shape and mass";
  }
}

bool check_mass(const Link& link, const Body& body, Findings& out) {
  const Inertial& inertial = *link.inertial;
  if (inertial.mass < 0) {
    SetInertia fix;
    fix.link = link.name;
    fix.mass = -inertial.mass;
    Operation repair;
    repair.action = fix;
    repair.why = "a mass is positive";
    out.add("inertia.mass_negative", subject(link), inertial.source,
            fmt::format("its mass is {:g} kg", inertial.mass))
        .repair = {repair};
    return false;
  }
  if (inertial.mass == 0) {
    const bool alone = body.joint != nullptr && !(body.mass.mass > 0);
    out.add("inertia.mass_zero", alone ? Severity::warning : Severity::note, subject(link), inertial.source,
            alone ? fmt::format("its mass is 0, and '{}' moves it", body.joint->name) : "its mass is 0");
    return false;
  }
  return true;
}

void report_zero(const Link& link, const Body& body, const std::optional<LinkShape>& shape, Findings& out) {
  Finding& f =
      out.add("inertia.zero", graded(link, body, Severity::warning), subject(link), link.inertial->source,
              fmt::format("all its moments of inertia are 0, at {:g} kg", link.inertial->mass));
  if (computable(link, shape)) f.repair = {compute(link, "the tensor was left at zero")};
}

struct RoundedLinks {
  std::vector<const Link*> few_digits, chosen;
};

// True where the tensor is physically possible.
bool check_tensor(const Link& link, const Body& body, const std::optional<LinkShape>& shape,
                  RoundedLinks& rounded_links, Findings& out) {
  const Components c = components_of(*link.inertial);
  if (std::all_of(c.begin(), c.end(), [](double x) { return std::abs(x) <= kNothing; })) {
    report_zero(link, body, shape, out);
    return false;
  }
  if (identity(c)) {
    report_identity(link, shape, out);
    return false;
  }
  if (rounded(c)) {
    const bool error = few_digits(c) && link.inertial->mass > kDummy && body.joint != nullptr;
    (error ? rounded_links.few_digits : rounded_links.chosen).push_back(&link);
    return false;
  }
  const Eigen::Vector3d moments = principal_moments(c);
  if (moments[0] > 0 && triangle_excess(moments) <= kNoExcess) return true;
  report_impossible(link, body, c, shape, out);
  return false;
}

// It has an <inertial> that the parser rejects.
bool refused(const Link& link, const Findings& out) {
  return out.has("urdf.inertial", subject(link));
}

void check_unweighed(const AuditInput& in, const std::vector<Body>& all, Findings& out) {
  const bool none = std::none_of(in.robot.links.begin(), in.robot.links.end(),
                                 [&](const Link& l) { return l.inertial || refused(l, out); });
  const auto moving = std::count_if(all.begin(), all.end(), [](const Body& b) { return b.joint != nullptr; });
  if (none && moving > 0) {
    out.add("inertia.none", "the robot", in.robot.source,
            "no link has an <inertial>: it can be displayed and used for planning, but not simulated");
    return;
  }
  for (const Body& body : all) {
    const bool refused = std::any_of(body.links.begin(), body.links.end(),
                                     [&](const Link* l) { return out.has("urdf.inertial", subject(*l)); });
    if (body.joint == nullptr || body.weighed || refused) continue;
    const Link& link = *body.links.front();
    const bool has_shape = std::any_of(body.links.begin(), body.links.end(), [](const Link* l) {
      return !l->visuals.empty() || !l->collisions.empty();
    });
    out.add("inertia.missing", has_shape ? Severity::warning : Severity::note, subject(link), link.source,
            fmt::format("'{}' moves it, and {} no <inertial>", body.joint->name,
                        body.links.size() == 1 ? "it has" : "neither it nor the links fixed to it have"));
  }
}

// A link of a ton, by the shapes that its mass is estimated from: their unit is wrong. A mesh with a
// finding about its unit is not reported a second time.
void check_estimates(const AuditInput& in, Findings& out) {
  constexpr double kTon = 1000;
  if (in.model == nullptr) return;
  for (const ModelLink& estimated : in.model->links) {
    const Link* link = in.robot.find_link(estimated.name);
    if (link == nullptr || !estimated.inertia || estimated.inertia->mass < kTon) continue;
    if (link->inertial && link->inertial->mass > 0) continue;
    if (out.has("mesh.unit", subject(*link))) continue;
    out.add("inertia.estimated_tons", subject(*link), link->source,
            fmt::format("its mass is estimated from its shapes as {:.3g} kg", estimated.inertia->mass));
  }
}

}  // namespace

bool readable(const AuditInput& in, const Link& link, const Findings& out) {
  if (!link.inertial->tensor_written) return false;
  const std::string name = subject(link);
  const auto of_parser = [](const Finding& f) {
    return f.rule == "urdf.number" || f.rule == "urdf.vector" || f.rule == "urdf.missing_attribute";
  };
  const XmlNode* node = nullptr;
  return std::none_of(out.all().begin(), out.all().end(), [&](const Finding& f) {
    if (!of_parser(f) || f.subject != name) return false;
    if (node == nullptr) node = element_at(in.expanded.root, link.inertial->source);
    return node != nullptr && holds(*node, f.where);
  });
}

void check_inertia(const AuditInput& in, Findings& out) {
  const std::vector<Body> all = bodies(in.robot);
  check_unweighed(in, all, out);
  check_estimates(in, out);
  RoundedLinks rounded_links;
  SuspectUnits suspects;
  for (const Body& body : all) {
    for (const Link* link : body.links) {
      if (!link->inertial || !readable(in, *link, out) || !check_mass(*link, body, out)) continue;
      const auto shape = link_shape(*link);
      const bool sound = check_tensor(*link, body, shape, rounded_links, out);
      if (shape) check_against_shape(*link, *shape, sound, suspects, out);
    }
  }
  report_units(suspects, out);
  report_rounded(rounded_links.few_digits, Severity::error, out);
  report_rounded(rounded_links.chosen, Severity::warning, out);
  check_twins(in, out);
}

}  // namespace doppel::audit_rules
