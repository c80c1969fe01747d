// The meshes that a description names: whether they can be read, fit in size, are closed and light enough.
#include <algorithm>
#include <cmath>
#include <set>

#include "doppel/review/audit/detail/inertia_rules.h"
#include "doppel/review/audit/detail/rules.h"

namespace doppel::audit_rules {
namespace {

constexpr std::size_t kManyTriangles = 200000, kFarTooMany = 1000000;  // of one visual
constexpr std::size_t kManyColliding = 20000;                          // of one collision shape
constexpr double kGigantic = 30, kMinute = 0.01;                       // against the robot's reach
constexpr double kDegenerateShare = 0.02;
constexpr std::size_t kFewMissing = 3;

struct MeshUse {
  const Link* link;
  const MeshGeometry* mesh;
  SourceLocation where;
  bool collides;
};

std::vector<MeshUse> uses_of(const RobotDescription& robot) {
  std::vector<MeshUse> out;
  for (const Link& link : robot.links) {
    for (const Visual& v : link.visuals) {
      if (const auto* mesh = std::get_if<MeshGeometry>(&v.geometry))
        out.push_back({&link, mesh, v.source, false});
    }
    for (const Collision& c : link.collisions) {
      if (const auto* mesh = std::get_if<MeshGeometry>(&c.geometry))
        out.push_back({&link, mesh, c.source, true});
    }
  }
  return out;
}

std::string file_name(const MeshGeometry& mesh) {
  return std::filesystem::path(mesh.uri).filename().string();
}

// Neither the readers of doppel nor assimp can read it. Without a collision mesh planners and simulators do
// not detect contacts; a visual mesh is only missing in the picture.
void report_problem(const MeshUse& use, bool collides, const MeshReport& report, Findings& out) {
  const std::string message = fmt::format("'{}': {}", file_name(*use.mesh), report.problem);
  if (report.rule == "mesh.not_fetched" || report.rule == "audit.skipped") {
    out.add(report.rule, subject(*use.link), use.where, message);
    return;
  }
  out.add("mesh.unreadable", collides ? Severity::error : Severity::warning, subject(*use.link), use.where,
          message);
}

// Once per file, independent of its users.
void check_file(const MeshUse& use, bool collides, Findings& out) {
  const MeshReport& report = cached_mesh_report(use.mesh->path);
  const std::string name = file_name(*use.mesh);
  if (!report.problem.empty()) return report_problem(use, collides, report, out);
  if (!report.remark.empty()) {
    out.add("mesh.irregular", subject(*use.link), use.where,
            fmt::format("'{}' is read as in RViz and Gazebo, although {}", name, report.remark));
  }
  if (report.solid.volume < 0 && report.open_edges == 0) {
    out.add("mesh.inverted", subject(*use.link), use.where,
            fmt::format("the faces of '{}' point inwards", name));
  }
  if (report.crossed_edges > 0) {
    out.add("mesh.crossed", subject(*use.link), use.where,
            fmt::format("at {} edges of '{}' the orientation of the faces is inconsistent",
                        report.crossed_edges, name));
  } else if (report.open_edges > 0) {
    out.add("mesh.open", subject(*use.link), use.where,
            fmt::format("'{}' is not closed: {} open edges", name, report.open_edges));
  }
  if (static_cast<double>(report.degenerate) > kDegenerateShare * static_cast<double>(report.triangles)) {
    out.add("mesh.degenerate", subject(*use.link), use.where,
            fmt::format("{} of the {} triangles of '{}' have no area", report.degenerate, report.triangles,
                        name));
  }
  if (report.hull_volume == 0) {
    out.add("mesh.flat", subject(*use.link), use.where, fmt::format("'{}' is flat", name));
  }
}

void check_triangles(const MeshUse& use, Findings& out) {
  const MeshReport& report = cached_mesh_report(use.mesh->path);
  const std::size_t budget = use.collides ? kManyColliding : kManyTriangles;
  if (report.triangles <= budget) return;
  const bool far = use.collides || report.triangles > kFarTooMany;
  out.add("mesh.triangles", far ? Severity::warning : Severity::note, subject(*use.link), use.where,
          fmt::format("'{}' has {} triangles; a {} shape should have fewer than {}", file_name(*use.mesh),
                      report.triangles, use.collides ? "collision" : "visual", budget));
}

bool check_scale(const MeshUse& use, Findings& out) {
  const Eigen::Vector3d& scale = use.mesh->scale;
  if ((scale.array() == 0).any()) {
    out.add("mesh.scale_zero", subject(*use.link), use.where,
            fmt::format("'{}' is scaled by {:g} {:g} {:g}", file_name(*use.mesh), scale.x(), scale.y(),
                        scale.z()));
    return false;
  }
  if (scale.cwiseAbs().maxCoeff() > 1.001 * scale.cwiseAbs().minCoeff()) {
    out.add("mesh.scale_uneven", subject(*use.link), use.where,
            fmt::format("'{}' is scaled by {:g} {:g} {:g}, differently along its axes", file_name(*use.mesh),
                        scale.x(), scale.y(), scale.z()));
  }
  return true;
}

// The link as it would be without the signs of its scales.
Link unmirrored(const Link& link) {
  Link out = link;
  const auto straighten = [](auto& elements) {
    for (auto& element : elements) {
      if (auto* mesh = std::get_if<MeshGeometry>(&element.geometry)) mesh->scale = mesh->scale.cwiseAbs();
    }
  };
  straighten(out.visuals);
  straighten(out.collisions);
  return out;
}

// m, of the joints that the link carries from a shape, in sum.
double joints_outside(const RobotDescription& robot, const Link& link, const LinkShape& shape) {
  double out = 0;
  for (const Joint& joint : robot.joints) {
    if (joint.parent == link.name) out += std::max(0.0, distance_outside(shape, joint.origin.xyz));
  }
  return out;
}

enum class Mirroring { unknown, mistake, confirmed };

// A mistake where the centre of mass is inside of the link only without the signs of its scales. Confirmed
// where the joints that it carries fit the mirrored meshes better: then it is the centre of mass that is
// wrong.
Mirroring mirroring_of(const RobotDescription& robot, const Link& link) {
  const Link straight = unmirrored(link);
  const auto written = link_shape(link), meant = link_shape(straight);
  if (!written || !meant) return Mirroring::unknown;
  if (joints_outside(robot, link, *written) < joints_outside(robot, link, *meant))
    return Mirroring::confirmed;
  const bool outside = link.inertial && centre_outside(link, *written) > 0;
  return outside && centre_outside(straight, *meant) == 0 ? Mirroring::mistake : Mirroring::unknown;
}

// The operation sets the scale of every mesh of the link, so it is only correct for one file.
bool shows_one_file(const Link& link) {
  std::set<std::string> files;
  for (const Visual& v : link.visuals) {
    if (const auto* mesh = std::get_if<MeshGeometry>(&v.geometry)) files.insert(mesh->path);
  }
  for (const Collision& c : link.collisions) {
    if (const auto* mesh = std::get_if<MeshGeometry>(&c.geometry)) files.insert(mesh->path);
  }
  return files.size() == 1;
}

// One side of a robot is often the mirrored mesh of the other: that file is also used without the sign.
void check_sign(const RobotDescription& robot, const MeshUse& use, const std::vector<MeshUse>& uses,
                Findings& out) {
  const Eigen::Vector3d& scale = use.mesh->scale;
  if (!(scale.array() < 0).any()) return;
  const bool twin = std::any_of(uses.begin(), uses.end(), [&](const MeshUse& other) {
    return other.mesh->path == use.mesh->path && (other.mesh->scale.array() > 0).all();
  });
  const Mirroring mirroring = mirroring_of(robot, *use.link);
  const bool mistake = mirroring == Mirroring::mistake, confirmed = mirroring == Mirroring::confirmed;
  const Eigen::Vector3d plain = scale.cwiseAbs();
  Finding& f =
      out.add("mesh.scale_negative",
              mistake             ? Severity::error
              : twin || confirmed ? Severity::note
                                  : Severity::warning,
              subject(*use.link), use.where,
              fmt::format("'{}' is scaled by {:g} {:g} {:g}, which mirrors it{}", file_name(*use.mesh),
                          scale.x(), scale.y(), scale.z(),
                          mistake     ? "; with a positive scale the centre of mass is inside it"
                          : confirmed ? "; the joints that the link carries fit the mirrored mesh"
                                      : ""),
              confirmed ? "nothing, if the part is the mirrored one"
                        : fmt::format("write scale=\"{:g} {:g} {:g}\"", plain.x(), plain.y(), plain.z()));
  if (!mistake || !shows_one_file(*use.link)) return;
  Operation repair;
  repair.action = SetMeshScale{use.link->name, plain};
  repair.why = "the negative scale mirrors the mesh";
  f.repair = {repair};
}

// The largest distance of a joint from the root, by the lengths of origins; 0: all in one place.
double reach_of(const RobotDescription& robot, const Findings& out) {
  double sum = 0;
  for (const Joint& joint : robot.joints) {
    const double unit = out.has("joint.origin_units", subject(joint)) ? 1e-3 : 1.0;
    sum += unit * joint.origin.xyz.norm();
  }
  return sum;
}

std::optional<double> extent(const MeshGeometry& mesh) {
  if (mesh.path.empty()) return std::nullopt;
  const MeshReport& report = cached_mesh_report(mesh.path);
  if (!report.problem.empty()) return std::nullopt;
  return (report.upper - report.lower).cwiseProduct(mesh.scale).norm();
}

// A mesh that is thirty times as large as the reach of the joints, or far too small: the unit of its file
// is not the one that its scale assumes.
void check_unit(const MeshUse& use, double reach, const std::vector<double>& extents, Findings& out) {
  const auto size = extent(*use.mesh);
  if (!size || !(*size > 0)) return;
  const double median = extents[extents.size() / 2];
  const double against = reach > 0 ? reach : extents.size() > 2 ? median : 0;
  if (!(against > 0)) return;
  const double scale = use.mesh->scale.cwiseAbs().maxCoeff();
  const bool large = *size > kGigantic * against && *size > 10;
  const bool small = *size < 1e-3 && *size * 1e3 < 3 * against && *size * 1e3 > kMinute * against;
  if (!large && !small) return;
  const double factor = large ? 1e-3 : 1e3;
  Operation repair;
  repair.action = SetMeshScale{use.link->name, use.mesh->scale * factor};
  repair.why = large ? "the file is in millimetres" : "the scale converts from millimetres twice";
  Finding& f = out.add(
      "mesh.unit", large ? Severity::error : Severity::warning, subject(*use.link), use.where,
      fmt::format(
          "'{}' is {:.3g} m long at its scale of {:g}, and all the joints' offsets together are {:.3g} m: {}",
          file_name(*use.mesh), *size, scale, reach,
          large ? "the file is in millimetres" : "it is a thousand times too small"),
      fmt::format("write scale=\"{0:g} {0:g} {0:g}\"", scale * factor));
  if (large && shows_one_file(*use.link)) f.repair = {repair};
}

// One finding for the whole robot: exporters do this for every link.
void check_visuals_as_collisions(const RobotDescription& robot, Findings& out) {
  std::vector<std::string> links;
  SourceLocation where;
  std::size_t most = 0;
  for (const Link& link : robot.links) {
    std::set<std::string> shown;
    for (const Visual& v : link.visuals) {
      if (const auto* mesh = std::get_if<MeshGeometry>(&v.geometry)) shown.insert(mesh->uri);
    }
    for (const Collision& c : link.collisions) {
      const auto* mesh = std::get_if<MeshGeometry>(&c.geometry);
      if (mesh == nullptr || !shown.contains(mesh->uri)) continue;
      if (links.empty()) where = c.source;
      if (links.empty() || links.back() != link.name) links.push_back(link.name);
      if (!mesh->path.empty()) most = std::max(most, cached_mesh_report(mesh->path).triangles);
    }
  }
  if (links.empty()) return;
  out.add("mesh.visual_as_collision", most > kManyColliding ? Severity::warning : Severity::note,
          links.size() == 1 ? fmt::format("link '{}'", links[0]) : fmt::format("{} links", links.size()),
          where,
          fmt::format("the visual mesh is also the collision shape, in {}{}", names_of(links),
                      most > 0 ? fmt::format("; up to {} triangles", most) : ""));
}

// The parser reports each use of a missing mesh. One finding for each mesh is enough, and one for all where
// the whole folder is missing.
void fold_missing(Findings& out) {
  std::vector<Finding>& all = out.all();
  std::set<std::string> reported;
  std::erase_if(all, [&](const Finding& f) {
    return f.rule == "mesh.missing" && !reported.insert(f.subject + f.message).second;
  });
  const auto alike = [](const Finding& f) {
    return f.rule == "mesh.missing" && !f.fix.starts_with("did you mean");
  };
  if (std::count_if(all.begin(), all.end(), alike) <= static_cast<std::ptrdiff_t>(kFewMissing)) return;
  const auto first = std::find_if(all.begin(), all.end(), alike);
  std::vector<std::string> names;
  for (const Finding& f : all) {
    const std::size_t begin = f.message.find('\''), end = f.message.find('\'', begin + 1);
    if (!alike(f) || end == std::string::npos) continue;
    const std::string uri = f.message.substr(begin + 1, end - begin - 1);
    const std::string name = std::filesystem::path(uri).filename().string();
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  first->subject = fmt::format("{} meshes", names.size());
  first->message = fmt::format("{} are not found; marked boxes replace them. The first one: {}",
                               names_of(names), first->message);
  const Finding folded = *first;
  std::erase_if(all, alike);
  all.push_back(folded);
}

}  // namespace

void check_meshes(const AuditInput& in, Findings& out) {
  fold_missing(out);
  const double reach = reach_of(in.robot, out);
  const std::vector<MeshUse> uses = uses_of(in.robot);
  std::vector<double> extents;
  for (const MeshUse& use : uses) {
    if (const auto size = extent(*use.mesh)) extents.push_back(*size);
  }
  std::sort(extents.begin(), extents.end());
  std::set<std::string> seen, colliding;
  for (const MeshUse& use : uses) {
    if (use.collides) colliding.insert(use.mesh->path);
  }
  std::set<std::pair<std::string, bool>> counted;
  std::set<std::pair<const Link*, std::string>> placed;
  for (const MeshUse& use : uses) {
    if (use.mesh->path.empty()) continue;
    if (seen.insert(use.mesh->path).second) check_file(use, colliding.contains(use.mesh->path), out);
    if (counted.emplace(use.mesh->path, use.collides).second) check_triangles(use, out);
    if (!placed.emplace(use.link, use.mesh->path).second) continue;
    check_sign(in.robot, use, uses, out);
    // A scale that cannot be read counts as 1.
    if (check_scale(use, out) && !out.has("urdf.vector", subject(*use.link)))
      check_unit(use, reach, extents, out);
  }
  check_visuals_as_collisions(in.robot, out);
}

}  // namespace doppel::audit_rules
