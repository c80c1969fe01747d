#include "doppel/scenario/sdf/detail/sdf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "doppel/base/core/names.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/text.h"
#include "doppel/base/xml/xml_tree.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/scenario/sdf/detail/sdf_lighting.h"
#include "doppel/scenario/sdf/detail/sdf_population.h"

namespace doppel::sdf {

namespace fs = std::filesystem;

namespace {

constexpr int kMaxDepth = 50;                             // of nested and included models
constexpr std::size_t kMaxBytes = std::size_t{64} << 20;  // of a file
constexpr std::size_t kMaxItems = 200'000;  // elements of models, of a world with all that it includes
constexpr std::size_t kMaxPlaces = 12;      // named in a message
const Eigen::Vector4d kWarningColour{1.0, 0.2, 0.7, 1.0};

std::pair<int, int> sdf_version(const std::string& text) {
  std::pair<int, int> out{1, 11};
  const char* const end = text.data() + text.size();
  const auto [dot, failed] = std::from_chars(text.data(), end, out.first);
  if (failed == std::errc{} && dot != end && *dot == '.') std::from_chars(dot + 1, end, out.second);
  return out;
}

bool is_world_root(const XmlNode& root) {
  return root.is("sdf") || root.is("gazebo") || root.is("world") || root.is("model");
}

}  // namespace

struct Document::Override {
  const XmlNode* include = nullptr;
  std::string name;
  WrittenPose pose;
  bool fixed = false;  // <static>true</static>
  std::string placement_frame;
  bool merge = false;
};

const Source* Document::parse(std::string text, const std::string& name, const fs::path& folder) {
  const XmlTree tree = parse_xml_tree(std::move(text), name, XmlContent::content, XmlRules::lenient);
  for (Diagnostic tolerated : tree.tolerated) {
    tolerated.message =
        tolerated.message.substr(0, tolerated.message.find("; urdfdom")) + "; Gazebo accepts it";
    elements_.diagnostics.add(std::move(tolerated));
  }
  return keep(tree.node(), folder);
}

const Source* Document::keep(XmlNode root, const fs::path& folder) {
  auto source = std::make_unique<Source>();
  source->folder = folder;
  source->root = std::move(root);
  source->version = sdf_version(Elements::attribute(source->root, "version"));
  texts_.push_back(std::move(source));
  return texts_.back().get();
}

const Source* Document::load(const fs::path& file) {
  const auto known = sources_.find(file);
  if (known != sources_.end()) return known->second.get();
  const Source* const made = parse(read_file(file.string(), kMaxBytes), file.string(), file.parent_path());
  read_files_.push_back(file);
  // An included file is parsed once, and kept while the document lives, because items point into its tree.
  sources_[file] = std::move(texts_.back());
  texts_.pop_back();
  return made;
}

const XmlNode& Document::made(std::string text) {
  return parse(std::move(text), "built in", {})->root;
}

void Document::read(std::string text, const std::string& name, const fs::path& folder, SdfWorld& out) {
  read_source(*parse(std::move(text), name, folder), name, out);
}

void Document::read(XmlNode root, const std::string& name, const fs::path& folder, SdfWorld& out) {
  read_source(*keep(std::move(root), folder), name, out);
}

void Document::read_source(const Source& source, const std::string& name, SdfWorld& out) {
  const XmlNode& root = source.root;
  if (!is_world_root(root)) {
    throw InputError("sdf.not_sdf", root.where,
                     fmt::format("<{}> is not the root of an SDF file{}", root.name.substr(0, 40),
                                 root.is("robot") ? "; this is a URDF" : ""),
                     "give a file with <sdf>");
  }
  out.version = Elements::attribute(root, "version");
  if (source.version > std::pair(1, 11)) {
    elements_.diagnostics.note(
        "sdf.version", root.where,
        fmt::format("version {} of SDF is newer than 1.11; what 1.11 does not have is ignored", out.version));
  }
  if (root.is("sdf") || root.is("gazebo")) elements_.check(root, "sdf");
  const XmlNode* const world = root.is("world") ? &root : root.first("world");
  world_.is_world = true;
  world_.source = &source;
  world_.node = world != nullptr ? world : &root;
  // The defaults of a world file of Gazebo: ODE takes the smaller friction of two, and the ground is a
  // model of the file.
  out.settings.friction_rule = FrictionRule::smaller;
  out.settings.ground = false;
  if (world != nullptr) {
    for (const XmlNode& other : root.children) {
      if (other.is("world") && &other != world)
        elements_.without_effect(other.where, "a second <world>", "one world is simulated");
    }
    out.is_world = true;
    return read_world(*world, source, out);
  }
  out.settings.name = world_.name = fs::path(name).stem().string();
  out.settings.ground = true;
  // A model without a world stands on our own ground.
  if (root.is("model")) return read_model(root, source, world_, nullptr, 0);
  read_items(root, source, world_, &out, 0);
  if (world_.items.empty() && out.settings.lights.empty())
    elements_.error("sdf.not_sdf", root.where, "the file has neither a <world> nor a <model>");
}

void Document::read_world(const XmlNode& node, const Source& source, SdfWorld& out) {
  elements_.check(node, "world");
  out.settings.name = world_.name = Elements::attribute(node, "name");
  if (const auto gravity = elements_.vector<3>(node, "gravity")) out.settings.gravity = *gravity;
  if (const XmlNode* const physics = node.first("physics")) read_physics(*physics, out);
  if (const XmlNode* const scene = node.first("scene")) {
    out.settings.environment = read_environment(*scene, elements_);
  }
  read_earth(node, out.earth);
  for (const XmlNode& child : node.children) {
    if (!child.is("plugin")) continue;
    elements_.without_effect(child.where, "<plugin> of a <world>", "plugins of SDF are kept, but not loaded");
    out.plugins.push_back({Elements::attribute(child, "filename"),
                           Elements::attribute(child, "name"),
                           {},
                           to_xml(child),
                           child.where});
  }
  state_ = node.first("state");
  read_items(node, source, world_, &out, 0);
}

void Document::read_earth(const XmlNode& node, EarthFrame& out) {
  if (const auto field = elements_.vector<3>(node, "magnetic_field")) out.magnetic_field = *field;
  const XmlNode* const place = node.first("spherical_coordinates");
  if (place == nullptr) return;
  elements_.check(*place, "spherical_coordinates");
  out.is_given = true;
  out.origin = {elements_.number_or(*place, "latitude_deg", 0),
                elements_.number_or(*place, "longitude_deg", 0), elements_.number_or(*place, "elevation", 0)};
  out.heading = elements_.number_or(*place, "heading_deg", 0) * std::numbers::pi / 180;
  const std::string surface = Elements::text(*place, "surface_model");
  if (!surface.empty() && surface != "EARTH_WGS84")
    elements_.without_effect(place->first("surface_model")->where, "<surface_model>" + surface,
                             "places are on the ellipsoid EARTH_WGS84");
  const std::string axes = Elements::text(*place, "world_frame_orientation");
  if (!axes.empty() && axes != "ENU")
    elements_.without_effect(place->first("world_frame_orientation")->where,
                             "<world_frame_orientation>" + axes, "x of the world is east, as with ENU");
}

void Document::read_physics(const XmlNode& node, SdfWorld& out) {
  elements_.check(node, "physics");
  if (const auto gravity = elements_.vector<3>(node, "gravity")) out.settings.gravity = *gravity;
  const std::optional<double> step = elements_.number(node, "max_step_size");
  if (!step) return;
  if (*step >= kMinStep && *step <= kMaxStep) {
    out.settings.step = from_seconds(*step);
    out.settings.step_is_given = true;
    return;
  }
  elements_.diagnostics.warning("sdf.step", node.first("max_step_size")->where,
                                fmt::format("the step of {} s is not from {} to {} s; {} s is used", *step,
                                            kMinStep, kMaxStep, to_seconds(out.settings.step)),
                                "write 0.001 for a step of 1 ms");
}

void Document::read_items(const XmlNode& node, const Source& source, Scope& scope, SdfWorld* world,
                          int depth) {
  for (const XmlNode& child : node.children) {
    if (child.kind != XmlNode::Kind::element) continue;
    if (++elements_read_ > kMaxItems) {
      throw InputError(
          "sdf.too_much", child.where,
          fmt::format("the world has more than {} elements, with all that it includes", kMaxItems),
          "remove an <include>, or what the included models include");
    }
    if (child.is("model")) {
      read_model(child, source, scope, nullptr, depth + 1);
    } else if (child.is("include")) {
      read_include(child, source, scope, world, depth + 1);
    } else if (child.is("frame") || (child.is("link") && !scope.is_world)) {
      Item item;
      item.kind = child.is("link") ? Item::Kind::link : Item::Kind::frame;
      item.name = Elements::attribute(child, "name");
      item.node = &child;
      item.source = &source;
      item.pose = elements_.pose(child);
      item.attached_to = Elements::attribute(child, "attached_to");
      elements_.check(child, child.name);
      scope.add(std::move(item));
    } else if (child.is("joint")) {
      add_joint(child, source, scope);
    } else if (child.is("plugin") && !scope.is_world) {
      scope.plugins.push_back(&child);
    } else if (child.is("sensor") && !scope.is_world) {
      scope.sensors.push_back(&child);
    } else if (child.is("light") && world != nullptr) {
      const WrittenPose pose = elements_.pose(child);
      world->settings.lights.push_back(read_light(child, pose.X, pose.where.known(), elements_));
    } else if (child.is("population") && scope.is_world) {
      read_population(child, source, scope, world, depth + 1);
    } else if (child.is("actor")) {
      elements_.without_effect(child.where, fmt::format("<{}>", child.name));
    }
  }
}

void Document::add_joint(const XmlNode& node, const Source& source, Scope& scope) {
  elements_.check(node, "joint");
  Item item;
  item.kind = Item::Kind::joint;
  item.name = Elements::attribute(node, "name");
  item.node = &node;
  item.source = &source;
  item.pose = elements_.pose(node);
  const auto end = [&](const char* which) {
    const XmlNode* const written = node.first(which);
    if (written == nullptr) return std::string();
    const XmlNode* const link = written->first("link_name");  // of SDF 1.2
    return link != nullptr ? link->content() : written->content();
  };
  item.parent = end("parent");
  item.child = end("child");
  for (const auto& [which, name] : {std::pair("parent", item.parent), std::pair("child", item.child)}) {
    if (name.empty()) {
      elements_.error("sdf.value", node.where, fmt::format("the joint '{}' has no <{}>", item.name, which),
                      "name a link of the model, or world");
      return;
    }
  }
  scope.add(std::move(item));
}

void Document::read_model(const XmlNode& node, const Source& source, Scope& into, const Override* over,
                          int depth) {
  if (depth > kMaxDepth) {
    elements_.error("sdf.too_deep", node.where,
                    fmt::format("models are nested in more than {} levels", kMaxDepth));
    return;
  }
  elements_.check(node, "model");
  Item item;
  item.kind = Item::Kind::model;
  item.node = over != nullptr && over->include != nullptr ? over->include : &node;
  item.source = &source;
  item.name = over != nullptr && !over->name.empty() ? over->name : Elements::attribute(node, "name");
  item.pose = over != nullptr && over->pose.where.known() ? over->pose : elements_.pose(node);
  item.scope = std::make_unique<Scope>();
  Scope& scope = *item.scope;
  scope.name = item.name;
  scope.node = &node;
  scope.source = &source;
  scope.canonical_link = Elements::attribute(node, "canonical_link");
  scope.placement_frame = Elements::attribute(node, "placement_frame");
  if (over != nullptr && !over->placement_frame.empty()) scope.placement_frame = over->placement_frame;
  scope.is_static = elements_.truth(node, "static", false) || (over != nullptr && over->fixed);
  // An <include> may also free a model that is static in its own file.
  if (over != nullptr && over->include->first("static") != nullptr) scope.is_static = over->fixed;
  scope.self_collide = elements_.truth(node, "self_collide", false);
  read_items(node, source, scope, nullptr, depth);
  if (over != nullptr) {
    for (const XmlNode& child : over->include->children) {
      if (child.is("plugin")) scope.plugins.push_back(&child);
    }
  }
  if (!scope.placement_frame.empty()) {
    item.X_M_placement =
        frames_.pose(scope, scope.placement_frame, "", over != nullptr ? over->include->where : node.where);
  }
  if (over != nullptr && over->merge && !into.is_world) return merge(std::move(item), into);
  into.add(std::move(item));
}

// The parts of the model become parts of the scope; "__model__" in them is a frame at the model's place.
void Document::merge(Item model, Scope& into) {
  Item frame;
  frame.kind = Item::Kind::frame;
  frame.name = fmt::format("_merged__{}__model__", model.name);
  frame.node = model.node;
  frame.source = model.source;
  frame.pose = model.pose;
  frame.X_M_placement = model.X_M_placement;
  if (const LinkRef root = frames_.canonical(*model.scope); root.found && root.scope == model.scope.get())
    frame.attached_to = root.link->name;
  // Its pose is relative to the scope even where it is attached to one of the merged links.
  if (frame.pose.relative_to.empty()) frame.pose.relative_to = kModelFrame;
  const std::string proxy = frame.name;
  into.add(std::move(frame));
  for (Item& item : model.scope->items) {
    item.state = Item::State::open;
    if (item.base.empty()) item.base = proxy;
    into.add(std::move(item));
  }
  into.plugins.insert(into.plugins.end(), model.scope->plugins.begin(), model.scope->plugins.end());
  into.sensors.insert(into.sensors.end(), model.scope->sensors.begin(), model.scope->sensors.end());
}

void Document::read_urdf(const fs::path& file, Scope& into, const Override& over) {
  Item item;
  item.kind = Item::Kind::model;
  item.node = over.include;
  item.source = into.source;
  item.pose = over.pose;
  LoadedDescription loaded = load_corrected(file, {}, resolver_, elements_.diagnostics);
  read_files_.insert(read_files_.end(), loaded.files.begin(), loaded.files.end());
  item.name = over.name.empty() ? loaded.robot.name : over.name;
  item.scope = std::make_unique<Scope>();
  item.scope->name = item.name;
  item.scope->is_static = over.fixed;
  item.scope->node = over.include;
  item.scope->source = into.source;
  item.urdf = std::make_shared<RobotDescription>(std::move(loaded.robot));
  if (into.is_world) return into.add(std::move(item));
  elements_.without_effect(over.include->where, "a URDF included in a model", "include it in the world");
}

void Document::read_include(const XmlNode& node, const Source& source, Scope& into, SdfWorld* world,
                            int depth) {
  read_include(node, source, into, world, depth, Elements::text(node, "name"), elements_.pose(node));
}

void Document::read_include(const XmlNode& node, const Source& source, Scope& into, SdfWorld* world,
                            int depth, const std::string& name, const WrittenPose& pose) {
  elements_.check(node, "include");
  Override over;
  over.include = &node;
  over.name = name;
  over.pose = pose;
  over.fixed = elements_.truth(node, "static", false);
  over.placement_frame = Elements::text(node, "placement_frame");
  const std::string merged = Elements::attribute(node, "merge");
  over.merge = merged == "true" || merged == "1";
  const std::string uri = Elements::text(node, "uri");
  if (uri.empty()) return elements_.error("sdf.value", node.where, "this <include> has no <uri>");
  FoundFile found;
  if (files_.search() != nullptr) found = files_.search()->find(uri, source.folder);
  fs::path file = found.path;
  std::error_code none;
  if (fs::is_directory(file, none)) file = model_file(file);
  if (file.empty()) {
    if (built_in(uri, over, into, world, depth)) return;
    return stand_in(node, over, uri, found, into);
  }
  if (std::find(including_.begin(), including_.end(), file) != including_.end())
    return elements_.error("sdf.include_cycle", node.where, fmt::format("'{}' includes itself", uri));
  const std::string extension = lowered(file.extension().string());
  if (extension == ".urdf" || extension == ".xacro") return read_urdf(file, into, over);
  const Source* const included = load(file);
  including_.push_back(file);
  const XmlNode& root = included->root;
  const XmlNode* model = root.is("model") ? &root : root.first("model");
  const XmlNode* const light = root.first("light");
  if (model != nullptr) {
    read_model(*model, *included, into, &over, depth);
  } else if (light != nullptr && world != nullptr) {
    const WrittenPose own = elements_.pose(*light);
    world->settings.lights.push_back(read_light(*light, over.pose.where.known() ? over.pose.X : own.X,
                                                over.pose.where.known(), elements_));
  } else {
    elements_.without_effect(node.where, fmt::format("the <include> of '{}'", uri), "it contains no model");
  }
  including_.pop_back();
}

// Each copy is named "MODEL_clone_3" and keeps the orientation of the model, as in Gazebo classic.
void Document::read_population(const XmlNode& node, const Source& source, Scope& into, SdfWorld* world,
                               int depth) {
  elements_.check(node, "population");
  const XmlNode* const model = node.first("model");
  const XmlNode* const include = node.first("include");
  const XmlNode* const copied = model != nullptr ? model : include;
  if (copied == nullptr)
    return elements_.error("sdf.value", node.where, "this <population> has no <model> or <include>");
  const auto places = population_places(node, elements_);
  if (!places) return;
  const WrittenPose frame = elements_.pose(node);
  for (std::size_t i = 0; i < places->size(); ++i) {
    const std::size_t before = into.items.size();
    Override over;
    over.include = copied;
    over.name = fmt::format("{}_clone_{}", Elements::attribute(node, "name"), i);
    over.pose = elements_.pose(*copied);
    over.pose.X = frame.X * Eigen::Translation3d((*places)[i]) * Pose(over.pose.X.linear());
    over.pose.relative_to = frame.relative_to;
    over.pose.where = frame.where.known() ? frame.where : node.where;
    if (model != nullptr) {
      over.fixed = elements_.truth(*model, "static", false);
      read_model(*model, source, into, &over, depth);
    } else {
      read_include(*include, source, into, world, depth, over.name, over.pose);
    }
    if (into.items.size() == before) return;  // the error of the first copy is that of all
  }
}

// The two models that nearly every world includes and that Gazebo brings along.
bool Document::built_in(const std::string& uri, const Override& over, Scope& into, SdfWorld* world,
                        int depth) {
  std::string name = uri.substr(uri.rfind('/') + 1);
  for (char& c : name) c = c == ' ' ? '_' : c;
  name = lowered(name);
  if (name == "sun" && world != nullptr) {
    const XmlNode& root = made(
        "<sdf version='1.9'><light type='directional' name='sun'><cast_shadows>true</cast_shadows>"
        "<pose>0 0 10 0 0 0</pose><diffuse>0.8 0.8 0.8 1</diffuse><specular>0.2 0.2 0.2 1</specular>"
        "<direction>-0.5 0.1 -0.9</direction></light></sdf>");
    world->settings.lights.push_back(
        read_light(*root.first("light"), over.pose.X, over.pose.where.known(), elements_));
  } else if (name == "ground_plane") {
    const XmlNode& root = made(
        "<sdf version='1.9'><model name='ground_plane'><static>true</static><link name='link'>"
        "<collision name='collision'><geometry><plane><normal>0 0 1</normal><size>100 "
        "100</size></plane></geometry>"
        "<surface><friction><ode><mu>100</mu><mu2>50</mu2></ode></friction></surface></collision>"
        "<visual name='visual'><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>"
        "<material><script><name>Gazebo/Grey</name></script></material></visual></link></model></sdf>");
    read_model(*root.first("model"), *texts_.back(), into, &over, depth);
  } else {
    return false;
  }
  elements_.diagnostics.note(
      "sdf.built_in", over.include->where,
      fmt::format("'{}' is not found on this machine; doppel's own '{}' is used", uri, name));
  return true;
}

// A box of half a metre in a warning colour, which collides with nothing, because the model's size is unknown.
void Document::stand_in(const XmlNode& node, const Override& over, const std::string& uri,
                        const FoundFile& found, Scope& into) {
  files_.add_missing(uri);
  if (stand_ins_[uri]++ == 0) {
    std::vector<std::string> tried = found.tried;
    const std::size_t all = tried.size();
    if (all > kMaxPlaces) tried.resize(kMaxPlaces);
    elements_.diagnostics.warning(
        "sdf.missing_model", node.where,
        fmt::format(
            "the model '{}' is not found; a box of 0.5 m that collides with nothing is drawn for each "
            "<include> of it; searched: {}{}",
            uri, tried.empty() ? "nowhere" : fmt::format("{}", fmt::join(tried, ", ")),
            all > tried.size() ? fmt::format(" and {} more places", all - tried.size()) : ""),
        "set GZ_SIM_RESOURCE_PATH to the folder that contains it; `doppel world fetch` lists what is "
        "missing");
  }
  std::string name = uri.substr(uri.rfind('/') + 1);
  if (name.empty()) name = "missing_model";
  Override named = over;
  if (named.name.empty()) named.name = name;
  if (into.find(named.name) != nullptr && over.name.empty())
    named.name = fmt::format("{}_{}", named.name, stand_ins_[uri]);
  named.merge = false;
  named.placement_frame.clear();
  const XmlNode& root = made(fmt::format(
      "<sdf version='1.9'><model name='m'><static>true</static><link name='link'><visual name='stand_in'>"
      "<pose>0 0 0.25 0 0 0</pose><geometry><box><size>0.5 0.5 0.5</size></box></geometry><material><diffuse>"
      "{} {} {} 1</diffuse></material></visual></link></model></sdf>",
      kWarningColour[0], kWarningColour[1], kWarningColour[2]));
  named.fixed = true;
  const std::size_t before = into.items.size();
  read_model(*root.first("model"), *texts_.back(), into, &named, 0);
  if (into.items.size() > before) into.items.back().scope->is_stand_in = true;
}

}  // namespace doppel::sdf
