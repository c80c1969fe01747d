#include "doppel/robot/scene_objects/scene_file.h"

#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

#include "doppel/base/core/names.h"
#include "doppel/base/core/overloaded.h"
#include "doppel/base/core/read_file.h"

namespace doppel {
namespace {

constexpr std::size_t kLargestFile = 256U << 20U;

// The words of a text with their places.
class Scanner {
 public:
  Scanner(std::string_view text, const std::string& file)
      : text_(text), file_(std::make_shared<const std::string>(file)) {}

  [[nodiscard]] SourceLocation place() const { return {file_, line_, column_, nullptr}; }

  [[noreturn]] void fail(const std::string& what, const std::string& fix) const {
    throw InputError("scene.file", place(), what, fix);
  }

  // The rest of the line without the spaces around it.
  std::string_view line() {
    const std::size_t begin = position_;
    while (position_ < text_.size() && text_[position_] != '\n') step();
    std::string_view out = text_.substr(begin, position_ - begin);
    if (position_ < text_.size()) step();
    while (!out.empty() && is_space(out.front())) out.remove_prefix(1);
    while (!out.empty() && is_space(out.back())) out.remove_suffix(1);
    return out;
  }

  void skip_spaces() {
    while (position_ < text_.size() && is_space(text_[position_])) step();
  }

  // After skip_spaces(): the next word, which stays; empty at the end.
  std::string_view peek() {
    skip_spaces();
    std::size_t end = position_;
    while (end < text_.size() && !is_space(text_[end])) ++end;
    return text_.substr(position_, end - position_);
  }

  // The words on the line of the next word.
  int words_on_line() {
    skip_spaces();
    int out = 0;
    bool inside = false;
    for (std::size_t i = position_; i < text_.size() && text_[i] != '\n'; ++i) {
      const bool letter = !is_space(text_[i]);
      out += letter && !inside ? 1 : 0;
      inside = letter;
    }
    return out;
  }

  std::string_view word(const char* what) {
    const std::string_view out = peek();
    if (out.empty()) {
      fail(fmt::format("the file ends where {} should be", what),
           "a scene ends with a line that is a full stop; was the file cut off?");
    }
    for (std::size_t i = 0; i < out.size(); ++i) step();
    return out;
  }

  double number(const char* what) {
    const Scanner before = *this;
    const std::string_view text = word(what);
    double out = 0;
    const char* const first = text.data() + (text.starts_with('+') ? 1 : 0);
    const auto [end, problem] = std::from_chars(first, text.data() + text.size(), out);
    if (problem == std::errc() && end == text.data() + text.size() && std::isfinite(out)) return out;
    Scanner culprit = before;
    culprit.skip_spaces();
    culprit.fail(fmt::format("'{}' is no number, where {} should be", text, what),
                 "count the numbers of the shape or pose before it");
  }

  // Each of the things that are counted takes a character at least.
  std::size_t count(const char* what) { return whole(what, text_.size()); }

  std::uint32_t index(const char* what) {
    return static_cast<std::uint32_t>(whole(what, std::numeric_limits<std::uint32_t>::max()));
  }

 private:
  std::size_t whole(const char* what, std::size_t most) {
    const Scanner before = *this;
    const std::string_view text = word(what);
    std::size_t out = 0;
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), out);
    if (problem == std::errc() && end == text.data() + text.size() && out <= most) return out;
    Scanner culprit = before;
    culprit.skip_spaces();
    culprit.fail(fmt::format("'{}' cannot be {}", text, what), "it is a whole number; was the file cut off?");
  }

  static bool is_space(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }
  void step() {
    if (text_[position_++] == '\n') {
      ++line_;
      column_ = 1;
    } else {
      ++column_;
    }
  }

  std::string_view text_;
  std::shared_ptr<const std::string> file_;
  std::size_t position_ = 0;
  int line_ = 1, column_ = 1;
};

Pose read_pose(Scanner& scan) {
  Pose out = Pose::Identity();
  for (int i = 0; i < 3; ++i) out.translation()[i] = scan.number("a position");
  scan.skip_spaces();
  const Scanner before = scan;
  double q[4];
  for (double& part : q) part = scan.number("a rotation (quaternion x y z w)");
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  const double length = rotation.norm();
  if (!(length > 1e-6) || !std::isfinite(length))
    before.fail("a rotation is a quaternion of length 0", "no rotation is 0 0 0 1");
  out.linear() = rotation.normalized().toRotationMatrix();
  return out;
}

SharedTriangles read_mesh(Scanner& scan) {
  auto out = std::make_shared<TriangleMesh>();
  out->vertices.resize(scan.count("the number of a mesh's vertices"));
  out->triangles.resize(scan.count("the number of a mesh's triangles"));
  for (Eigen::Vector3f& vertex : out->vertices) {
    for (int i = 0; i < 3; ++i) vertex[i] = static_cast<float>(scan.number("a vertex of a mesh"));
  }
  for (auto& triangle : out->triangles) {
    for (std::uint32_t& corner : triangle) corner = scan.index("a corner of a triangle");
  }
  return out;
}

ObjectShape read_shape(Scanner& scan) {
  static const std::vector<std::string> kKinds{"box", "sphere", "cylinder", "cone", "plane", "mesh"};
  scan.skip_spaces();
  const Scanner before = scan;
  const std::string kind(scan.word("a shape"));
  ObjectShape out;
  if (kind == "box") {
    Box box;
    for (int i = 0; i < 3; ++i) box.size[i] = scan.number("a side of a box");
    out.geometry = box;
  } else if (kind == "sphere") {
    out.geometry = Sphere{scan.number("the radius of a sphere")};
  } else if (kind == "cylinder") {
    const double radius = scan.number("the radius of a cylinder");
    out.geometry = Cylinder{radius, scan.number("the length of a cylinder")};
  } else if (kind == "cone") {
    const double radius = scan.number("the radius of a cone");
    out.geometry = Cone{radius, scan.number("the length of a cone")};
  } else if (kind == "plane") {
    ScenePlane plane;
    for (int i = 0; i < 3; ++i) plane.normal[i] = scan.number("the normal of a plane");
    plane.offset = scan.number("the distance of a plane");
    out.geometry = plane;
  } else if (kind == "mesh") {
    out.geometry = read_mesh(scan);
  } else {
    before.fail(fmt::format("there is no shape '{}'{}", kind, did_you_mean(kind, kKinds)),
                "count the shapes of the object");
  }
  return out;
}

SceneObject read_object(Scanner& scan) {
  SceneObject out;
  const SourceLocation place = scan.place();
  out.id = std::string(scan.line());
  // The older form has no pose and no subframes, so that the number of shapes is alone on the first line.
  const bool newer = scan.words_on_line() > 1;
  if (newer) out.X_PO = read_pose(scan);
  const std::size_t shapes = scan.count("the number of shapes");
  for (std::size_t i = 0; i < shapes; ++i) {
    ObjectShape shape = read_shape(scan);
    shape.X_OS = read_pose(scan);
    out.shapes.push_back(std::move(shape));
    Eigen::Vector4f rgba;
    for (int k = 0; k < 4; ++k) rgba[k] = static_cast<float>(scan.number("a colour (r g b a)"));
    if (rgba.maxCoeff() > 0) out.rgba = rgba;
  }
  const std::size_t frames = newer ? scan.count("the number of subframes") : 0;
  for (std::size_t i = 0; i < frames; ++i) {
    Subframe frame;
    frame.name = std::string(scan.word("the name of a subframe"));
    frame.X_OF = read_pose(scan);
    out.subframes.push_back(std::move(frame));
  }
  check_object(out, place);
  return out;
}

std::string pose_text(const Pose& X) {
  const Eigen::Vector3d& p = X.translation();
  const Eigen::Quaterniond q(X.linear());
  return fmt::format("{} {} {}\n{} {} {} {}\n", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

std::string mesh_text(const TriangleMesh& mesh) {
  std::string out = fmt::format("mesh\n{} {}\n", mesh.vertices.size(), mesh.triangles.size());
  for (const Eigen::Vector3f& v : mesh.vertices) out += fmt::format("{} {} {}\n", v.x(), v.y(), v.z());
  for (const auto& t : mesh.triangles) out += fmt::format("{} {} {}\n", t[0], t[1], t[2]);
  return out;
}

std::string shape_text(const ObjectShape& shape) {
  return std::visit(
      Overloaded{
          [](const Box& box) {
            return fmt::format("box\n{} {} {}\n", box.size.x(), box.size.y(), box.size.z());
          },
          [](const Sphere& sphere) { return fmt::format("sphere\n{}\n", sphere.radius); },
          [](const Cylinder& c) { return fmt::format("cylinder\n{} {}\n", c.radius, c.length); },
          [](const Cone& c) { return fmt::format("cone\n{} {}\n", c.radius, c.length); },
          [](const ScenePlane& plane) {
            return fmt::format("plane\n{} {} {} {}\n", plane.normal.x(), plane.normal.y(), plane.normal.z(),
                               plane.offset);
          },
          [](const SharedTriangles& mesh) { return mesh_text(*mesh); },
          [](const SharedCells&) { return std::string(); },
      },
      shape.geometry);
}

}  // namespace

SceneFile parse_scene(std::string_view text, const std::string& file) {
  Scanner scan(text, file);
  SceneFile out;
  out.name = std::string(scan.line());
  for (;;) {
    scan.skip_spaces();
    const Scanner before = scan;
    const std::string_view marker = scan.word("'*' of an object, or '.' of the end");
    if (marker == ".") return out;
    if (marker != "*") {
      before.fail(fmt::format("'{}' is neither '*' of an object nor '.' of the end", marker),
                  "count the shapes and subframes of the object before it");
    }
    out.objects.push_back(read_object(scan));
  }
}

SceneFile read_scene(const std::string& path) {
  return parse_scene(read_file(path, kLargestFile), path);
}

std::string write_scene(const SceneFile& scene) {
  std::string out = scene.name + "\n";
  for (const SceneObject& object : scene.objects) {
    const bool is_octomap = std::holds_alternative<SharedCells>(object.shapes.front().geometry);
    if (!object.link.empty() || is_octomap) continue;
    const Eigen::Vector4f rgba = object.rgba.value_or(Eigen::Vector4f::Zero());
    out += fmt::format("* {}\n{}{}\n", object.id, pose_text(object.X_PO), object.shapes.size());
    for (const ObjectShape& shape : object.shapes) {
      out += shape_text(shape) + pose_text(shape.X_OS);
      out += fmt::format("{} {} {} {}\n", rgba[0], rgba[1], rgba[2], rgba[3]);
    }
    out += fmt::format("{}\n", object.subframes.size());
    for (const Subframe& frame : object.subframes) out += frame.name + "\n" + pose_text(frame.X_OF);
  }
  return out + ".\n";
}

}  // namespace doppel
