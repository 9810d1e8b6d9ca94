#include "client/cli/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <variant>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "client/cli/search_text.h"
#include "core/base/geometry.h"
#include "core/solve/summary.h"

namespace lpdeform::cli {
namespace {

using nlohmann::ordered_json;

/// Whether a kind of defect consists of edges, which are given as two vertices each.
bool is_of_edges(const std::string& kind) {
  return kind.ends_with("edges") || kind == "inconsistent_orientation";
}

ordered_json first_few(const client::Defect& defect) {
  if (!is_of_edges(defect.kind)) return defect.first;
  ordered_json edges = ordered_json::array();
  for (std::size_t k = 0; k + 1 < defect.first.size(); k += 2)
    edges.push_back({defect.first[k], defect.first[k + 1]});
  return edges;
}

std::string first_few_text(const client::Defect& defect) {
  std::vector<std::string> elements;
  for (const ordered_json& element : first_few(defect)) {
    elements.push_back(element.is_array() ? absl::StrCat(element[0].dump(), "-", element[1].dump())
                                          : element.dump());
  }
  return absl::StrJoin(elements, ", ");
}

ordered_json mesh_object(const client::MeshReport& mesh) {
  ordered_json object{{"vertices", mesh.vertices},
                      {"faces", mesh.faces},
                      {"edges", mesh.edges},
                      {"components", mesh.components},
                      {"boundary_loops", mesh.boundary_loops},
                      {"welded_vertices", mesh.welded_vertices}};
  ordered_json first = ordered_json::object();
  for (const client::Defect& defect : mesh.defects) {
    object[defect.kind] = defect.count;
    if (!defect.first.empty()) first[defect.kind] = first_few(defect);
  }
  object["first"] = std::move(first);
  return object;
}

ordered_json p_value(const client::FieldValue& p) {
  if (const double* const uniform = std::get_if<double>(&p)) return *uniform;
  if (const auto* const automatic = std::get_if<client::Automatic>(&p))
    return {{"automatic", automatic->strength}};
  const auto& values = std::get<std::vector<double>>(p);
  if (values.empty()) return nullptr;
  const auto [lowest, highest] = std::ranges::minmax(values);
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  return {{"min", lowest}, {"mean", mean}, {"max", highest}};
}

ordered_json trace_array(const std::vector<client::IterationRecord>& trace) {
  ordered_json array = ordered_json::array();
  for (const client::IterationRecord& record : trace) {
    array.push_back({{"iteration", record.iteration},
                     {"seconds", record.seconds},
                     {"energy", record.energy},
                     {"objective", record.objective},
                     {"stage", record.stage}});
  }
  return array;
}

ordered_json distortion_object(const std::vector<double>& distortion) {
  const Field field =
      Eigen::Map<const Field>(distortion.data(), static_cast<Eigen::Index>(distortion.size()));
  const DistortionStatistics statistics = distortion_statistics(field);
  return {{"min", statistics.min},
          {"mean", statistics.mean},
          {"max", statistics.max},
          {"median", statistics.median},
          {"top_5_percent_share", statistics.top_5_percent_share},
          {"histogram", {{"edges", statistics.edges}, {"counts", statistics.counts}}}};
}

std::string line_of(std::string_view label, std::int64_t count, const std::string& note = "") {
  return absl::StrFormat("%-26s %10d%s\n", std::string(label), count, note);
}

}  // namespace

std::string mesh_json(const client::MeshReport& mesh) {
  return mesh_object(mesh).dump(2) + "\n";
}

std::string mesh_text(const client::MeshReport& mesh) {
  std::string text = line_of("vertices", mesh.vertices) + line_of("faces", mesh.faces) +
                     line_of("edges", mesh.edges) + line_of("components", mesh.components) +
                     line_of("boundary loops", mesh.boundary_loops);
  if (mesh.welded_vertices > 0) text += line_of("welded vertices", mesh.welded_vertices);
  for (const client::Defect& defect : mesh.defects) {
    const std::string few = first_few_text(defect);
    const std::string note = few.empty() ? "" : absl::StrCat("   first: ", few);
    text += line_of(absl::StrReplaceAll(defect.kind, {{"_", " "}}), defect.count, note);
  }
  return text;
}

std::string report_json(const client::MeshReport& mesh, const client::FieldValue& p,
                        const client::SolveResult& result) {
  ordered_json gap = nullptr;
  if (result.optimality_gap) gap = *result.optimality_gap;
  const ordered_json report{{"mesh", mesh_object(mesh)},
                            {"p", p_value(p)},
                            {"method", result.method},
                            {"threads", result.threads},
                            {"stop_reason", client::stop_reason_name(result.stop_reason)},
                            {"iterations", result.iterations},
                            {"search_iterations", result.search_iterations},
                            {"initial_energy", result.initial_energy},
                            {"energy", result.energy},
                            {"soft_energy", result.soft_energy},
                            {"optimality_gap", gap},
                            {"minima", result.minima},
                            {"different_energies", different_energies(result.minima)},
                            {"effort", result.effort},
                            {"further_starts", result.further_starts},
                            {"setup_seconds", result.setup_seconds},
                            {"solve_seconds", result.solve_seconds},
                            {"trace", trace_array(result.trace)},
                            {"distortion", distortion_object(result.distortion)}};
  return report.dump(2) + "\n";
}

}  // namespace lpdeform::cli
