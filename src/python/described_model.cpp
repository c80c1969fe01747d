#include "python/described_model.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "doppel/base/core/installation.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/robot/reach/arm_reach.h"
#include "doppel/scenario/resolve/open_target.h"

namespace doppel::python {
namespace {

namespace fs = std::filesystem;

bool is_text(const std::string& source) {
  const std::size_t first = source.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return first != std::string::npos && source[first] == '<';
}

void write_text(const fs::path& file, std::string_view text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush())
    throw InputError("output.unwritable", {}, fmt::format("'{}' cannot be written", file.string()),
                     "set TMPDIR to a folder with room");
}

// YAML has a colon behind each key. An operation without a fingerprint corrects what is there now, because
// it was written for this model.
void correct(const std::string& overlay, ExpandedDescription& description, const PackageResolver& resolver,
             Diagnostics& diagnostics) {
  const bool is_file = overlay.find_first_of("\n:") == std::string::npos;
  const Overlay read = is_file ? read_overlay(overlay) : parse_overlay(overlay, "overlay");
  for (Operation operation : read.operations) {
    if (operation.was.empty()) take_fingerprint(operation, description);
    apply_overlay({read.file, {operation}}, description, resolver, diagnostics);
  }
}

// A URDF that is read elsewhere finds its meshes by absolute paths only.
void use_absolute_paths(XmlNode& node, const PackageResolver& resolver, const fs::path& base) {
  for (XmlAttribute& attribute : node.attributes) {
    if (attribute.name != "filename" || node.is("plugin") || node.is("library")) continue;
    const PackageResolver::Resolved found = resolver.resolve(attribute.value, base);
    if (!found.path.empty()) attribute.value = fs::absolute(found.path).string();
  }
  for (XmlNode& child : node.children) use_absolute_paths(child, resolver, base);
}

// A text is called so in messages, not by the file that it was written to.
std::vector<Diagnostic> without_folder(std::vector<Diagnostic> diagnostics, const DescribedModel& model) {
  if (!model.folder) return diagnostics;
  static const auto kText = std::make_shared<const std::string>("text");
  for (Diagnostic& diagnostic : diagnostics) {
    if (diagnostic.where.known() && diagnostic.where.file->starts_with(model.folder->path().string()))
      diagnostic.where.file = kText;
  }
  return diagnostics;
}

std::shared_ptr<const TemporaryFolder> folder_of(DescribedModel& out) {
  if (!out.folder) out.folder = std::make_shared<const TemporaryFolder>();
  return out.folder;
}

void load_into(DescribedModel& out, const std::string& source, XacroArguments arguments,
               const std::string& overlay, BaseKind base) {
  out.target = source;
  if (is_text(source)) {
    const bool xacro = source.find("xmlns:xacro") != std::string::npos;
    const fs::path file = folder_of(out)->path() / (xacro ? "model.urdf.xacro" : "model.urdf");
    write_text(file, source);
    out.target = file.string();
  }
  OpenedTarget opened = open_target(out.target, std::move(arguments), data_folder() / "robots");
  out.arguments = opened.arguments;
  out.file = opened.target.description;
  Diagnostics diagnostics;
  ExpandedDescription expanded =
      expand_for_simulation(opened.target.description, opened.arguments, opened.resolver, diagnostics);
  if (!overlay.empty()) correct(overlay, expanded, opened.resolver, diagnostics);
  RobotDescription robot = read_description(expanded, opened.resolver, diagnostics);
  diagnostics.throw_if_errors();
  out.model = std::make_shared<const Model>(compile_model(robot, base, diagnostics));
  out.robot = std::make_shared<const RobotDescription>(std::move(robot));
  out.twin_target = out.target;
  out.twin_arguments = out.arguments;
  if (!overlay.empty()) {
    use_absolute_paths(expanded.root, opened.resolver, expanded.folder());
    const fs::path file = folder_of(out)->path() / "corrected.urdf";
    write_text(file, to_xml(expanded.root));
    out.twin_target = file.string();
    out.twin_arguments.clear();
  }
  out.files = std::move(expanded.files);
  out.diagnostics = diagnostics.all();
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "doppel-model-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr)
    throw InputError("output.unwritable", {},
                     fmt::format("no folder can be made in '{}'", fs::temp_directory_path().string()),
                     "set TMPDIR to a folder with room");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  if (!process_.is_this_one()) return;
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::shared_ptr<const CollisionScene> DescribedModel::scene() const {
  std::call_once(scene_once_, [this] {
    Diagnostics notes;
    scene_ = reach_scene(*robot, model, nullptr, {}, notes);
  });
  return scene_;
}

std::shared_ptr<DescribedModel> load_model(const std::string& source, XacroArguments arguments,
                                           const std::string& overlay, BaseKind base) {
  auto out = std::make_shared<DescribedModel>();
  try {
    load_into(*out, source, std::move(arguments), overlay, base);
  } catch (const InputError& error) {
    throw InputError(without_folder(error.diagnostics(), *out));
  }
  out->diagnostics = without_folder(std::move(out->diagnostics), *out);
  return out;
}

}  // namespace doppel::python
