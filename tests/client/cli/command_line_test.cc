// The small parts of the command line: field files, outputs, exit statuses, the report.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "client/cli/exit_status.h"
#include "client/cli/files/core_motion.h"
#include "client/cli/files/field_file.h"
#include "client/cli/files/outputs.h"
#include "client/cli/generated_shape.h"
#include "client/cli/report.h"
#include "core/base/fault.h"

namespace lpdeform::cli {
namespace {

using client::StopReason;
using testing::HasSubstr;

TEST(FieldFile, ReadsOneNumberALine) {
  const auto field = parse_field("1\n 2.5 \r\n1e-3\n\n", 3, "p.txt");
  ASSERT_TRUE(field.ok()) << field.status();
  EXPECT_EQ(*field, (std::vector<double>{1, 2.5, 1e-3}));
}

TEST(FieldFile, NamesTheLineThatIsNotOneNumber) {
  for (const char* text : {"1\nx\n3\n", "1\n2 2\n3\n", "1\n\n3\n"}) {
    const auto field = parse_field(text, 3, "p.txt");
    EXPECT_EQ(fault_of(field.status()).reason, "FIELD_FILE_SYNTAX") << text;
    EXPECT_THAT(std::string(field.status().message()), HasSubstr("Line 2 of \"p.txt\"")) << text;
  }
}

TEST(FieldFile, NamesBothCountsWhereTheyDiffer) {
  const auto field = parse_field("1\n2\n", 3, "p.txt");
  EXPECT_EQ(fault_of(field.status()).reason, "FIELD_SIZE");
  EXPECT_THAT(std::string(field.status().message()), HasSubstr("2 numbers for 3 vertices"));
}

TEST(Outputs, AreRefusedBeforeAnyWorkWhereTheyCannotBeWritten) {
  const auto reason_of = [](const std::filesystem::path& path) {
    return fault_of(check_outputs(std::array{path})).reason;
  };
  EXPECT_EQ(reason_of("x.stl"), "OUT_FORMAT_UNKNOWN");
  EXPECT_EQ(reason_of("/nowhere/x.ply"), "FILE_NOT_WRITTEN");
  EXPECT_EQ(reason_of("x.PNG"), "");
}

TEST(Outputs, MustHoldTheNormalsThatAreAskedFor) {
  using Paths = std::vector<std::filesystem::path>;
  const auto reason_of = [](const Paths& paths) { return fault_of(check_normals_have_output(paths)).reason; };
  EXPECT_EQ(reason_of({"x.off", "x.png"}), "OUT_WITHOUT_NORMALS");
  EXPECT_EQ(reason_of({}), "OUT_WITHOUT_NORMALS");
  EXPECT_EQ(reason_of({"x.off", "x.OBJ"}), "");
  EXPECT_EQ(reason_of({"x.ply"}), "");
}

TEST(ExitStatus, IsZeroForWhatTheCallerAskedFor) {
  EXPECT_EQ(exit_status_of(StopReason::kConverged, false, false), kDone);
  EXPECT_EQ(exit_status_of(StopReason::kIterationLimit, true, false), kDone);
  EXPECT_EQ(exit_status_of(StopReason::kTimeLimit, false, true), kDone);
}

TEST(ExitStatus, IsOneForWhatEndedShortOfTheTolerance) {
  EXPECT_EQ(exit_status_of(StopReason::kIterationLimit, false, true), kShortOfTolerance);
  EXPECT_EQ(exit_status_of(StopReason::kTimeLimit, true, false), kShortOfTolerance);
  EXPECT_EQ(exit_status_of(StopReason::kStalled, true, true), kShortOfTolerance);
  EXPECT_EQ(exit_status_of(StopReason::kNumericalBreakdown, true, true), kShortOfTolerance);
}

TEST(ExitStatus, TellsBadInputFromARefusingServer) {
  EXPECT_EQ(exit_status_of(absl::InvalidArgumentError("")), kBadInput);
  EXPECT_EQ(exit_status_of(absl::FailedPreconditionError("")), kBadInput);
  EXPECT_EQ(exit_status_of(absl::NotFoundError("")), kBadInput);
  EXPECT_EQ(exit_status_of(absl::UnavailableError("")), kNoServer);
  EXPECT_EQ(exit_status_of(absl::ResourceExhaustedError("")), kNoServer);
  EXPECT_EQ(exit_status_of(absl::UnauthenticatedError("")), kNoServer);
}

client::SolveResult small_result() {
  client::SolveResult result;
  result.positions.assign(6, 0.0);
  result.distortion = {1, 3};
  result.method = "quasi_newton";
  result.stop_reason = StopReason::kConverged;
  result.trace = {{0, 0.0, 9.0, 9.0, 0}};
  return result;
}

TEST(Report, HasEveryKeyThatIsPromised) {
  const client::MeshReport mesh{.vertices = 2, .faces = 1, .defects = {{"clamped_edges", 1, {0, 1}}}};
  const auto report = nlohmann::json::parse(report_json(mesh, 1.5, small_result()));
  for (const char* key :
       {"mesh", "p", "method", "threads", "stop_reason", "iterations", "initial_energy", "energy",
        "optimality_gap", "minima", "different_energies", "effort", "further_starts", "search_iterations",
        "setup_seconds", "solve_seconds", "trace", "distortion"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  for (const char* key : {"min", "mean", "max", "median", "top_5_percent_share"}) {
    EXPECT_TRUE(report["distortion"].contains(key)) << key;
  }
  EXPECT_EQ(report["mesh"]["clamped_edges"], 1);
  EXPECT_EQ(report["mesh"]["first"]["clamped_edges"], nlohmann::json::parse("[[0, 1]]"));
  EXPECT_EQ(report["mesh"], nlohmann::json::parse(mesh_json(mesh)));
  EXPECT_EQ(report["p"], 1.5);
  EXPECT_EQ(report["stop_reason"], "converged");
  EXPECT_EQ(report["trace"][0]["energy"], 9.0);
  EXPECT_EQ(report["distortion"]["mean"], 2.0);
}

TEST(Report, SaysNullWhereTheGapWasNotComputed) {
  client::SolveResult result = small_result();
  EXPECT_TRUE(nlohmann::json::parse(report_json({}, 2.0, result))["optimality_gap"].is_null());
  result.optimality_gap = 1e-4;
  EXPECT_EQ(nlohmann::json::parse(report_json({}, 2.0, result))["optimality_gap"], 1e-4);
}

TEST(Report, HasTheEnergiesOfAllMinimaAndHowManyDiffer) {
  client::SolveResult result = small_result();
  result.minima = {9, 8, 8.001, 9};
  result.further_starts = 5;
  result.search_iterations = 40;
  result.effort = 2;
  const auto report = nlohmann::json::parse(report_json({}, 1.5, result));
  EXPECT_EQ(report["minima"], nlohmann::json::parse("[9.0, 8.0, 8.001, 9.0]"));
  EXPECT_EQ(report["different_energies"], 2);
  EXPECT_EQ(report["further_starts"], 5);
  EXPECT_EQ(report["search_iterations"], 40);
  EXPECT_EQ(report["effort"], 2);
}

TEST(Report, SumsUpAFieldOfP) {
  const auto report = nlohmann::json::parse(report_json({}, std::vector<double>{1, 3}, small_result()));
  EXPECT_EQ(report["p"]["min"], 1.0);
  EXPECT_EQ(report["p"]["mean"], 2.0);
  EXPECT_EQ(report["p"]["max"], 3.0);
}

TEST(MeshText, ShowsTheFirstOffendersWithEdgesAsPairs) {
  const client::MeshReport mesh{.vertices = 5, .defects = {{"non_manifold_edges", 2, {0, 1, 3, 4}}}};
  EXPECT_THAT(mesh_text(mesh), HasSubstr("non manifold edges                  2   first: 0-1, 3-4"));
}

TEST(CoreMotion, IsTheSameThereAndBack) {
  const HandleMotion motions[] = {Fixed{}, RigidMotion{{1, 2, 3}, 0.5, {4, 5, 6}, {7, 8, 9}},
                                  TargetPositions{Points::Random(2, 3)}};
  for (const HandleMotion& motion : motions)
    EXPECT_TRUE(to_core(to_client(motion)) == motion) << motion.index();
}

TEST(GeneratedShape, EveryOneHasHandlesThatItsMeshHolds) {
  for (const std::string& name : generated_shape_names()) {
    const auto shape = generate_shape(name, 1);
    ASSERT_TRUE(shape.ok()) << name;
    const auto read = parse_handles(handle_file_text(shape->handles, "", ""), shape->mesh.vertices.rows());
    EXPECT_TRUE(read.ok()) << name << ": " << read.status();
  }
}

TEST(GeneratedShape, TheBarAndTheSheetAreThePapers) {
  EXPECT_EQ(generate_shape("bar", 1)->mesh.vertices.rows(), 370);
  EXPECT_EQ(generate_shape("sheet", 1)->mesh.faces.rows(), 7920);
}

TEST(GeneratedShape, HasAboutAsManyVerticesAsAskedFor) {
  const auto check = [](const std::string& name, int vertices, double most) {
    const auto shape = generate_shape_of(name, vertices);
    ASSERT_TRUE(shape.ok()) << name;
    const double ratio = static_cast<double>(shape->mesh.vertices.rows()) / vertices;
    EXPECT_LE(std::max(ratio, 1 / ratio), most) << name << " of " << vertices;
    std::set<std::uint32_t> held;
    std::size_t count = 0;
    for (const NamedHandle& handle : shape->handles) {
      EXPECT_FALSE(handle.handle.vertices.empty()) << name;
      held.insert(handle.handle.vertices.begin(), handle.handle.vertices.end());
      count += handle.handle.vertices.size();
    }
    EXPECT_EQ(held.size(), count) << name << ": handles have vertices in common";
  };
  for (const char* name : {"bar", "block", "grid", "neck", "sheet"}) {
    for (const int vertices : {450, 1721, 8100}) {
      if (vertices >= generate_shape(name, 1)->mesh.vertices.rows()) check(name, vertices, 1.15);
    }
    for (const int vertices : {15000, 123456}) check(name, vertices, 1.05);
  }
  for (const char* name : {"creature", "arm", "pierced_block", "scan", "tree"}) check(name, 4000, 1.05);
  for (const int vertices : {2562, 4000, 50000}) check("sphere", vertices, 2);
}

TEST(GeneratedShape, RefusesTooFewAndTooManyVertices) {
  for (const int vertices : {-1, 0, 369, 5'000'001, std::numeric_limits<int>::max()}) {
    const auto shape = generate_shape_of("bar", vertices);
    EXPECT_EQ(fault_of(shape.status()).reason, "SHAPE_DETAIL") << vertices;
    EXPECT_EQ(fault_of(shape.status()).limit, "370 <= vertices <= 5000000");
  }
  EXPECT_EQ(generate_shape_of("bar", 370)->mesh.vertices.rows(), 370);
  EXPECT_EQ(fault_of(generate_shape_of("cube", 1000).status()).reason, "SHAPE_UNKNOWN");
}

TEST(GeneratedShape, NamesWhatThereIs) {
  EXPECT_THAT(std::string(generate_shape("cube", 1).status().message()), HasSubstr("creature"));
  EXPECT_EQ(fault_of(generate_shape("bar", 0).status()).reason, "SHAPE_DETAIL");
}

}  // namespace
}  // namespace lpdeform::cli
