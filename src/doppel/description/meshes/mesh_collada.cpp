// COLLADA 1.4 and 1.5: the geometry of the scene, with its nodes' transforms and the document's unit; the up
// axis is not applied, as in RViz and Gazebo. Source: Khronos, COLLADA Digital Asset Schema Release 1.4.1.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <map>
#include <numbers>
#include <unordered_map>

#include "doppel/base/xml/xml.h"
#include "doppel/description/meshes/detail/mesh.h"
#include "doppel/description/meshes/detail/text_scanner.h"

namespace doppel::mesh {
namespace {

using Transform = Eigen::Affine3d;

constexpr std::size_t kMaxTriangles = 20'000'000;
constexpr int kMaxNodes = 200'000, kMaxDepth = 100;  // nodes may instantiate other nodes recursively

class ColladaReader {
 public:
  ColladaReader(const XmlNode& root, const std::string& name) : root_(root), name_(name) {
    collect_ids(root);
  }

  TriangleSoup read() {
    Transform X = Transform::Identity();
    if (const XmlNode* asset = root_.first("asset")) {
      if (const XmlNode* unit = asset->first("unit"); unit != nullptr && unit->find("meter") != nullptr) {
        const auto metres = TextScanner::to_number(unit->find("meter")->value);
        if (!metres || !(*metres > 0))
          refuse_at(*unit, "the document's unit is not a positive number of metres");
        X.scale(*metres);
      }
    }
    if (const XmlNode* scene = shown_scene()) {
      for (const XmlNode& node : scene->children) {
        if (node.is("node")) show_node(node, X, 0);
      }
    } else {
      for (const XmlNode& library : root_.children) {
        if (!library.is("library_geometries")) continue;
        for (const XmlNode& geometry : library.children) {
          if (geometry.is("geometry")) show_geometry(geometry, X);
        }
      }
    }
    return std::move(soup_);
  }

 private:
  [[noreturn]] void refuse_at(const XmlNode& node, std::string message) const {
    refuse(name_, node.where.line, std::move(message));
  }

  void collect_ids(const XmlNode& node) {
    if (const XmlAttribute* id = node.find("id")) ids_.emplace(id->value, &node);
    for (const XmlNode& child : node.children) {
      if (child.kind == XmlNode::Kind::element) collect_ids(child);
    }
  }
  // The element to which an attribute such as url="#arm" refers; nullptr: there is none in this document.
  [[nodiscard]] const XmlNode* follow(const XmlNode& node, std::string_view attribute) const {
    const XmlAttribute* link = node.find(attribute);
    if (link == nullptr) return nullptr;
    const std::string_view id = std::string_view(link->value).substr(link->value.starts_with('#') ? 1 : 0);
    const auto found = ids_.find(std::string(id));
    return found == ids_.end() ? nullptr : found->second;
  }
  [[nodiscard]] const XmlNode* shown_scene() const {
    if (const XmlNode* scene = root_.first("scene")) {
      if (const XmlNode* instance = scene->first("instance_visual_scene")) return follow(*instance, "url");
    }
    const XmlNode* library = root_.first("library_visual_scenes");
    return library == nullptr ? nullptr : library->first("visual_scene");
  }

  template <int count>
  Eigen::Matrix<double, count, 1> numbers(const XmlNode& node) const {
    Eigen::Matrix<double, count, 1> out;
    const std::string content = node.content();
    TextScanner text(content);
    for (int i = 0; i < count; ++i) {
      const auto value = text.number();
      if (!value) refuse_at(node, fmt::format("<{}> needs {} numbers", node.name, count));
      out[i] = *value;
    }
    return out;
  }

  [[nodiscard]] Transform transform_of(const XmlNode& step) const {
    Transform X = Transform::Identity();
    if (step.is("matrix")) {
      const auto m = numbers<16>(step);
      X.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
      X.makeAffine();
    } else if (step.is("translate")) {
      X.translate(Eigen::Vector3d(numbers<3>(step)));
    } else if (step.is("scale")) {
      X.scale(Eigen::Vector3d(numbers<3>(step)));
    } else if (step.is("rotate")) {
      const auto r = numbers<4>(step);
      const Eigen::Vector3d axis = r.head<3>();
      if (axis.norm() > 1e-12)
        X.rotate(Eigen::AngleAxisd(r[3] * std::numbers::pi / 180.0, axis.normalized()));
    } else if (step.is("lookat")) {
      const auto l = numbers<9>(step);
      const Eigen::Vector3d eye = l.head<3>(), z = (eye - l.segment<3>(3)).normalized(),
                            x = l.tail<3>().cross(z).normalized();
      X.linear() << x, z.cross(x), z;
      X.translation() = eye;
    }
    return X;
  }

  void show_node(const XmlNode& node, const Transform& X_parent, int depth) {
    if (++nodes_ > kMaxNodes || depth > kMaxDepth)
      refuse_at(node, "the scene's nodes instantiate each other in a cycle");
    Transform X = X_parent;
    for (const XmlNode& child : node.children) {
      if (child.kind == XmlNode::Kind::element) X = X * transform_of(child);
    }
    for (const XmlNode& child : node.children) {
      if (child.is("node")) {
        show_node(child, X, depth + 1);
      } else if (child.is("instance_node")) {
        if (const XmlNode* other = follow(child, "url")) show_node(*other, X, depth + 1);
      } else if (child.is("instance_geometry")) {
        if (const XmlNode* geometry = follow(child, "url")) {
          find_colour(child);
          const std::size_t begin = soup_.triangles.size();
          show_geometry(*geometry, X);
          soup_.parts.push_back({names_of(node, *geometry), begin, soup_.triangles.size()});
        }
      } else if (child.is("instance_controller")) {
        if (const XmlNode* geometry = skinned(child)) {
          find_colour(child);
          const std::size_t begin = soup_.triangles.size();
          show_geometry(*geometry, X);
          soup_.parts.push_back({names_of(node, *geometry), begin, soup_.triangles.size()});
        }
      }
    }
  }

  // Gazebo names a submesh by the node that shows it, some exporters of its models by the geometry.
  static std::vector<std::string> names_of(const XmlNode& node, const XmlNode& geometry) {
    std::vector<std::string> out;
    for (const XmlNode* named : {&node, &geometry}) {
      for (const char* attribute : {"name", "id"}) {
        if (const XmlAttribute* written = named->find(attribute)) out.push_back(written->value);
      }
    }
    return out;
  }

  // The geometry under a skin, in its bind shape: robots' links do not bend.
  [[nodiscard]] const XmlNode* skinned(const XmlNode& instance) const {
    const XmlNode* controller = follow(instance, "url");
    const XmlNode* skin = controller == nullptr ? nullptr : controller->first("skin");
    return skin == nullptr ? nullptr : follow(*skin, "source");
  }

  void find_colour(const XmlNode& instance) {
    if (soup_.rgba) return;
    const XmlNode* at = instance.first("bind_material");
    for (const char* step : {"technique_common", "instance_material"})
      at = at == nullptr ? nullptr : at->first(step);
    if (at != nullptr) at = follow(*at, "target");
    if (at != nullptr) at = at->first("instance_effect");
    if (at != nullptr) at = follow(*at, "url");
    for (const char* step : {"profile_COMMON", "technique"}) at = at == nullptr ? nullptr : at->first(step);
    if (at == nullptr) return;
    for (const char* shading : {"phong", "lambert", "blinn", "constant"}) {
      const XmlNode* model = at->first(shading);
      const XmlNode* diffuse = model == nullptr ? nullptr : model->first("diffuse");
      const XmlNode* colour = diffuse == nullptr ? nullptr : diffuse->first("color");
      if (colour != nullptr) soup_.rgba = numbers<4>(*colour).cast<float>();
    }
  }

  void show_geometry(const XmlNode& geometry, const Transform& X) {
    const XmlNode* mesh = geometry.first("mesh");
    if (mesh == nullptr) return;
    for (const XmlNode& part : mesh->children) {
      if (part.is("triangles") || part.is("polylist") || part.is("polygons") || part.is("tristrips") ||
          part.is("trifans")) {
        show_part(part, X);
      }
    }
  }

  // The points of the part's VERTEX input.
  const std::vector<Eigen::Vector3d>& positions(const XmlNode& part, const XmlNode& input) {
    const XmlNode* vertices = follow(input, "source");
    const XmlNode* source = nullptr;
    if (vertices != nullptr && vertices->is("vertices")) {
      for (const XmlNode& child : vertices->children) {
        const XmlAttribute* semantic = child.is("input") ? child.find("semantic") : nullptr;
        if (semantic != nullptr && semantic->value == "POSITION") source = follow(child, "source");
      }
    }
    if (source == nullptr) refuse_at(part, "its VERTEX input has no positions");
    const auto [entry, fresh] = points_.try_emplace(source);
    if (fresh) read_positions(*source, entry->second);
    return entry->second;
  }

  std::size_t count_of(const XmlNode& node, std::string_view attribute, std::size_t fallback) const {
    const XmlAttribute* written = node.find(attribute);
    if (written == nullptr) return fallback;
    const auto value = TextScanner::to_number(written->value);
    if (!value || *value < 0 || *value > 4e9 || *value != std::floor(*value))
      refuse_at(node, fmt::format("its {} is '{}'", attribute, written->value));
    return static_cast<std::size_t>(*value);
  }

  void read_positions(const XmlNode& source, std::vector<Eigen::Vector3d>& out) const {
    const XmlNode* array = source.first("float_array");
    const XmlNode* technique = source.first("technique_common");
    const XmlNode* accessor = technique == nullptr ? nullptr : technique->first("accessor");
    if (array == nullptr || accessor == nullptr)
      refuse_at(source, "this source contains no array of positions");
    const std::size_t stride = count_of(*accessor, "stride", 1), offset = count_of(*accessor, "offset", 0);
    if (stride < 3) refuse_at(*accessor, fmt::format("positions need a stride of 3, not {}", stride));
    std::vector<double> values;
    const std::string content = array->content();
    TextScanner text(content);
    for (std::string_view word = text.word(); !word.empty(); word = text.word()) {
      const auto value = TextScanner::to_number(word);
      if (!value) refuse_at(*array, fmt::format("'{}' is not a finite number", word.substr(0, 40)));
      values.push_back(*value);
    }
    for (std::size_t i = offset; i + 3 <= values.size(); i += stride)
      out.emplace_back(values[i], values[i + 1], values[i + 2]);
  }

  struct Layout {
    std::size_t stride = 1, vertex = 0;  // indices per corner, and which of them is the vertex
    const std::vector<Eigen::Vector3d>* points = nullptr;
  };
  Layout layout_of(const XmlNode& part) {
    Layout layout;
    for (const XmlNode& input : part.children) {
      if (!input.is("input")) continue;
      const std::size_t offset = count_of(input, "offset", 0);
      if (offset > 64) refuse_at(input, fmt::format("an offset of {} is too large", offset));
      layout.stride = std::max(layout.stride, offset + 1);
      const XmlAttribute* semantic = input.find("semantic");
      if (semantic == nullptr || semantic->value != "VERTEX") continue;
      layout.vertex = offset;
      layout.points = &positions(part, input);
    }
    if (layout.points == nullptr) refuse_at(part, fmt::format("this <{}> has no VERTEX input", part.name));
    return layout;
  }

  std::vector<std::uint32_t> corners_of(const XmlNode& p, const Layout& layout, std::uint32_t base) const {
    std::vector<std::uint32_t> out;
    const std::string content = p.content();
    TextScanner text(content);
    std::size_t i = 0;
    for (std::string_view word = text.word(); !word.empty(); word = text.word(), ++i) {
      if (i % layout.stride != layout.vertex) continue;
      std::size_t index = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
      if (error != std::errc{} || end != word.data() + word.size() || index >= layout.points->size()) {
        refuse_at(p, fmt::format("it refers to vertex '{}', but there are {}", word.substr(0, 40),
                                 layout.points->size()));
      }
      out.push_back(base + static_cast<std::uint32_t>(index));
    }
    return out;
  }

  void show_part(const XmlNode& part, const Transform& X) {
    const Layout layout = layout_of(part);
    if (soup_.triangles.size() > kMaxTriangles ||
        soup_.points.size() + layout.points->size() > 3 * kMaxTriangles)
      refuse_at(part, "the scene has more than twenty million triangles");
    const std::size_t first = soup_.triangles.size();
    const auto base = static_cast<std::uint32_t>(soup_.points.size());
    for (const Eigen::Vector3d& p : *layout.points) soup_.points.push_back((X * p).cast<float>());
    for (const XmlNode& child : part.children) {
      const XmlNode* p = child.is("p") ? &child : child.is("ph") ? child.first("p") : nullptr;
      if (p != nullptr) add_primitive(part, *p, corners_of(*p, layout, base));
    }
    for (std::size_t t = first; t < soup_.triangles.size(); ++t) {
      for (const std::uint32_t corner : soup_.triangles[t]) {
        if (!soup_.points[corner].allFinite())
          refuse_at(part, "its transforms move a vertex out of the range of numbers");
      }
      if (X.linear().determinant() < 0) std::swap(soup_.triangles[t][1], soup_.triangles[t][2]);
    }
  }

  void add_primitive(const XmlNode& part, const XmlNode& p, const std::vector<std::uint32_t>& corners) {
    if (part.is("polylist")) return add_polylist(part, corners);
    if (part.is("polygons")) {
      if (corners.size() >= 3) add_polygon(soup_, corners);
      return;
    }
    if (part.is("triangles")) {
      if (corners.size() % 3 != 0)
        refuse_at(p, fmt::format("{} vertices are not a multiple of three", corners.size()));
      for (std::size_t i = 0; i + 3 <= corners.size(); i += 3)
        soup_.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
      return;
    }
    const bool strip = part.is("tristrips");
    for (std::size_t i = 2; i < corners.size(); ++i) {
      if (!strip) {
        soup_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
      } else if (i % 2 == 0) {
        soup_.triangles.push_back({corners[i - 2], corners[i - 1], corners[i]});
      } else {
        soup_.triangles.push_back({corners[i - 1], corners[i - 2], corners[i]});
      }
    }
  }

  void add_polylist(const XmlNode& part, const std::vector<std::uint32_t>& corners) {
    const XmlNode* counts = part.first("vcount");
    if (counts == nullptr) refuse_at(part, "this <polylist> has no <vcount>");
    const std::string content = counts->content();
    TextScanner text(content);
    std::size_t at = 0;
    for (std::string_view word = text.word(); !word.empty(); word = text.word()) {
      std::size_t count = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
      if (error != std::errc{} || end != word.data() + word.size() || count > corners.size() - at) {
        refuse_at(*counts, fmt::format("the count '{}' exceeds the {} vertices of <p>", word.substr(0, 40),
                                       corners.size()));
      }
      const auto from = corners.begin() + static_cast<std::ptrdiff_t>(at);
      if (count >= 3) add_polygon(soup_, {from, from + static_cast<std::ptrdiff_t>(count)});
      at += count;
    }
  }

  const XmlNode& root_;
  const std::string& name_;
  std::unordered_map<std::string, const XmlNode*> ids_;
  std::map<const XmlNode*, std::vector<Eigen::Vector3d>> points_;  // by source
  TriangleSoup soup_;
  int nodes_ = 0;
};

}  // namespace

TriangleSoup read_collada(std::string_view bytes, const std::string& name) {
  const XmlNode root = parse_xml(bytes, name);
  if (root.name != "COLLADA")
    refuse(name, root.where.line, fmt::format("the root element is <{}>, not <COLLADA>", root.name));
  return ColladaReader(root, name).read();
}

}  // namespace doppel::mesh
