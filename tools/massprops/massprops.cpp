// For robots/build_meshes: `massprops binary IN.stl OUT.stl` converts OpenSCAD's text STL to binary STL,
// `massprops inertia SPEC` prints the <inertial> of every link computed from its meshes and their materials.
//
// SPEC consists of lines of words; lengths are in mm, masses in g, densities in g/cm^3, angles in rad (roll
// pitch yaw as in a URDF):
//   meshes FOLDER                   the folder of the parts' files, relative to that of SPEC
//   total G                         the mass of all links together; solves every `density balance`
//   link NAME [of G] [at X Y Z]     `of` fixes the mass and solves the link's `density solve`; X Y Z is the
//                                   link's origin in the meshes' frame
//   part FILE density D|solve|balance|mass G [placed X Y Z R P Y]
//                                   a solid; `placed` is its pose in the link's frame, otherwise the mesh is
//                                   in the frame of `at`
#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "doppel/base/math/mass_properties.h"
#include "doppel/base/math/pose.h"

static_assert(std::endian::native == std::endian::little, "binary STL is little-endian");

namespace {

using Corner = std::array<float, 3>;
using Facet = std::array<Corner, 3>;

[[noreturn]] void fail(const std::string& message) {
  throw std::runtime_error(message);
}

std::vector<Facet> read_stl(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(fmt::format("{}: cannot be opened", path.string()));
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  std::vector<Facet> facets;
  if (bytes.size() >= 84) {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + 80, 4);
    if (bytes.size() == 84 + 50 * static_cast<std::size_t>(count)) {
      facets.resize(count);
      for (std::size_t i = 0; i < count; ++i)
        std::memcpy(&facets[i], bytes.data() + 84 + 50 * i + 12, sizeof(Facet));
      return facets;
    }
  }
  std::istringstream text(bytes);
  std::string word;
  std::vector<Corner> corners;
  while (text >> word) {
    if (word != "vertex") continue;
    Corner c{};
    if (!(text >> c[0] >> c[1] >> c[2]))
      fail(fmt::format("{}: a vertex has no three numbers", path.string()));
    corners.push_back(c);
  }
  if (corners.empty() || corners.size() % 3 != 0) fail(fmt::format("{}: not an STL file", path.string()));
  for (std::size_t i = 0; i < corners.size(); i += 3)
    facets.push_back({corners[i], corners[i + 1], corners[i + 2]});
  return facets;
}

void write_binary(const std::vector<Facet>& facets, const std::filesystem::path& path) {
  std::ofstream file(path, std::ios::binary);
  std::array<char, 80> header{};
  constexpr std::string_view kTitle = "doppel, millimetres";
  std::copy(kTitle.begin(), kTitle.end(), header.begin());
  file.write(header.data(), header.size());
  const auto count = static_cast<std::uint32_t>(facets.size());
  file.write(reinterpret_cast<const char*>(&count), 4);
  for (const Facet& f : facets) {
    const auto v = [&](int i) {
      return Eigen::Map<const Eigen::Vector3f>(f[static_cast<std::size_t>(i)].data());
    };
    const Eigen::Vector3f n = (v(1) - v(0)).cross(v(2) - v(0)).normalized();
    file.write(reinterpret_cast<const char*>(n.data()), 12);
    file.write(reinterpret_cast<const char*>(&f), sizeof f);
    file.write("\0\0", 2);
  }
  if (!file.flush()) fail(fmt::format("{}: cannot be written", path.string()));
}

// OpenSCAD writes a solid's triangles in a different order in every run, and with its six digits slivers collapse
// (without them the solid is still closed). Sorted triangles give the same bytes for the same solid.
std::vector<Facet> canonical(std::vector<Facet> facets) {
  std::erase_if(facets, [](const Facet& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; });
  for (Facet& f : facets) {
    for (Corner& c : f) {
      for (float& x : c) x += 0.0F;  // -0 becomes 0
    }
    std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
  }
  std::sort(facets.begin(), facets.end());
  return facets;
}

doppel::SolidProperties solid_of(const std::filesystem::path& path) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::map<std::pair<Corner, Corner>, int> edges;  // each directed edge must meet its reverse
  for (const Facet& f : read_stl(path)) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const Corner& c : f) vertices.emplace_back(Eigen::Vector3f(c[0], c[1], c[2]) * 0.001F);
    triangles.push_back({first, first + 1, first + 2});
    for (std::size_t i = 0; i < 3; ++i) {
      const Corner& a = f[i];
      const Corner& b = f[(i + 1) % 3];
      a < b ? ++edges[{a, b}] : --edges[{b, a}];
    }
  }
  const auto open = std::count_if(edges.begin(), edges.end(), [](const auto& e) { return e.second != 0; });
  if (open > 0) fail(fmt::format("{}: {} edges are open, so it encloses no volume", path.string(), open));
  const doppel::SolidProperties solid = doppel::solid_properties(vertices, triangles);
  if (solid.volume <= 0) fail(fmt::format("{}: its triangles face inwards", path.string()));
  return solid;
}

struct Part {
  std::string file;
  std::optional<double> density, mass;  // kg/m^3, kg
  bool balance = false;                 // density comes from the total
  doppel::MassProperties unit;          // of density 1 kg/m^3, in the link's frame
};

struct Link {
  std::string name;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // m, in the meshes' frame
  std::optional<double> mass;                        // kg
  std::vector<Part> parts;
};

struct Spec {
  std::optional<double> total;  // kg
  std::vector<Link> links;
};

template <typename T>
T take(std::istringstream& words, const std::string& what) {
  T value{};
  if (!(words >> value)) fail("expected " + what);
  return value;
}

Eigen::Vector3d take_vector(std::istringstream& words) {
  const auto x = take<double>(words, "x"), y = take<double>(words, "y"), z = take<double>(words, "z");
  return {x, y, z};
}

Part read_part(std::istringstream& words, const Link& link, const std::filesystem::path& meshes) {
  Part part;
  part.file = take<std::string>(words, "a mesh");
  const doppel::SolidProperties solid = solid_of(meshes / part.file);
  doppel::Pose X_LM(Eigen::Translation3d(-link.origin));
  for (std::string word; words >> word;) {
    if (word == "mass") {
      part.mass = take<double>(words, "grams") * 1e-3;
    } else if (word == "density") {
      const auto value = take<std::string>(words, "a density, `solve` or `balance`");
      part.balance = value == "balance";
      if (!part.balance && value != "solve") part.density = std::stod(value) * 1e3;
    } else if (word == "placed") {
      const Eigen::Vector3d xyz = take_vector(words) * 1e-3, rpy = take_vector(words);
      X_LM = doppel::make_pose(xyz, rpy);
    } else {
      fail(fmt::format("unknown word `{}`", word));
    }
  }
  part.unit = doppel::transformed(solid.unit, X_LM);
  if (part.mass) part.density = *part.mass / solid.volume;
  return part;
}

Spec read_spec(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) fail(fmt::format("{}: cannot be opened", path.string()));
  Spec spec;
  std::filesystem::path meshes = path.parent_path();
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    std::string word;
    if (!(words >> word)) continue;
    try {
      if (word == "meshes") {
        meshes /= take<std::string>(words, "a folder");
      } else if (word == "total") {
        spec.total = take<double>(words, "grams") * 1e-3;
      } else if (word == "link") {
        Link& link = spec.links.emplace_back();
        link.name = take<std::string>(words, "a name");
        while (words >> word) {
          if (word == "of")
            link.mass = take<double>(words, "grams") * 1e-3;
          else if (word == "at")
            link.origin = take_vector(words) * 1e-3;
          else
            fail(fmt::format("unknown word `{}`", word));
        }
      } else if (word == "part" && !spec.links.empty()) {
        spec.links.back().parts.push_back(read_part(words, spec.links.back(), meshes));
      } else {
        fail(fmt::format("unknown line `{}`", word));
      }
    } catch (const std::exception& e) {
      fail(fmt::format("{}:{}: {}", path.string(), number, e.what()));
    }
  }
  return spec;
}

double known_mass(const Link& link) {
  double sum = 0;
  for (const Part& p : link.parts) sum += p.density.value_or(0) * p.unit.mass;
  return sum;
}

// Gives the parts in `unknown` a common density, so that their masses add up to `missing` kg.
void solve(const std::vector<Part*>& unknown, double missing, const std::string& what) {
  double volume = 0;
  for (const Part* p : unknown) volume += p->unit.mass;
  if (unknown.empty() || missing <= 0)
    fail(fmt::format("{}: nothing left to solve for ({} g)", what, missing * 1e3));
  for (Part* p : unknown) p->density = missing / volume;
}

void solve_densities(Spec& spec) {
  std::vector<Part*> balance;
  for (Link& link : spec.links) {
    std::vector<Part*> own;
    for (Part& p : link.parts) {
      if (!p.density) (p.balance ? balance : own).push_back(&p);
    }
    if (!own.empty()) {
      if (!link.mass) fail(fmt::format("link {}: `density solve` needs `of`", link.name));
      solve(own, *link.mass - known_mass(link), "link " + link.name);
    }
  }
  if (balance.empty()) return;
  if (!spec.total) fail("`density balance` needs `total`");
  double sum = 0;
  for (const Link& link : spec.links) sum += known_mass(link);
  solve(balance, *spec.total - sum, "total");
}

void print_link(const Link& link) {
  doppel::MassProperties body;
  for (const Part& p : link.parts) {
    doppel::MassProperties own = p.unit;
    own.mass *= *p.density;
    own.I *= *p.density;
    body = doppel::combined(body, own);
  }
  const Eigen::Vector3d e = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(body.I).eigenvalues();
  if (e[0] <= 0 || e[0] + e[1] < e[2]) fail(fmt::format("link {}: its inertia is not physical", link.name));
  // Values that are zero up to rounding are printed as zero.
  const double smallest_I = 1e-6 * e[2];
  const auto length = [](double v) { return fmt::format("{:.6g}", std::abs(v) < 5e-8 ? 0.0 : v); };
  const auto moment = [&](int i, int j) {
    return fmt::format("{:.6g}", std::abs(body.I(i, j)) < smallest_I ? 0.0 : body.I(i, j));
  };
  fmt::print("<!-- {}", link.name);
  for (const Part& p : link.parts) {
    fmt::print("; {} {:.2f} g, {:.3f} g/cm3", p.file, *p.density * p.unit.mass * 1e3, *p.density * 1e-3);
  }
  fmt::print(" -->\n<inertial>\n  <origin xyz=\"{} {} {}\" rpy=\"0 0 0\"/>\n  <mass value=\"{:.6g}\"/>\n",
             length(body.com.x()), length(body.com.y()), length(body.com.z()), body.mass);
  fmt::print("  <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>\n</inertial>\n",
             moment(0, 0), moment(0, 1), moment(0, 2), moment(1, 1), moment(1, 2), moment(2, 2));
}

void print_inertia(const std::filesystem::path& path) {
  Spec spec = read_spec(path);
  solve_densities(spec);
  double sum = 0;
  for (const Link& link : spec.links) {
    print_link(link);
    sum += known_mass(link);
  }
  fmt::print("<!-- {} links, {:.2f} g -->\n", spec.links.size(), sum * 1e3);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  try {
    if (words.size() == 3 && words[0] == "binary") {
      write_binary(canonical(read_stl(words[1])), words[2]);
    } else if (words.size() == 2 && words[0] == "inertia") {
      print_inertia(words[1]);
    } else {
      fail("usage: massprops binary IN.stl OUT.stl | massprops inertia SPEC");
    }
  } catch (const std::exception& e) {
    fmt::print(stderr, "massprops: {}\n", e.what());
    return 1;
  }
  return 0;
}
