// SPDX-License-Identifier: MIT
// jostle surface: meshes whose pairs, impacts and crossings are known.
#include <cmath>
#include <sstream>

#include <nlohmann/json.hpp>

#include "run_tool.hpp"

namespace tool_test {
namespace {

using nlohmann::json;

class SurfaceCommand : public ToolTest
{
  protected:
    /// The object that --json - prints.
    json told(std::vector<std::string> arguments)
    {
        arguments.insert(arguments.begin(), "surface");
        arguments.insert(arguments.end(), {"--json", "-"});
        const Result result = run(arguments);
        EXPECT_EQ(result.err, "");
        EXPECT_EQ(result.exit_code, 0);
        const json rows = json::parse(result.out);
        EXPECT_EQ(rows.size(), 1u);
        return rows[0];
    }
    void refused(const std::vector<std::string>& arguments, const std::string& message)
    {
        const Result result = run(arguments);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_EQ(result.out, "");
        EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
    }
    /// A square of two triangles in the plane y = 0, and a triangle whose lowest corner is at this height.
    static std::string strip_and_triangle(double height)
    {
        std::ostringstream text;
        text << "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 1 0 1\nv 0.25 " << height << " 0.25\nv 0.75 " << height + .5
             << " 0.25\nv 0.25 " << height + .5 << " 0.75\nf 1 2 3\nf 3 2 4\nf 5 6 7\n";
        return text.str();
    }
};

TEST_F(SurfaceCommand, TellsWhatIsNear)
{
    write("a.obj", strip_and_triangle(.25));
    const json row = told({"a.obj", "--distance", "0.3", "--pairs", "p.csv", "--threads", "2"});
    EXPECT_EQ(row["vertices"], 7); // of 9 corners
    EXPECT_EQ(row["triangles"], 3);
    EXPECT_EQ(row["edges"], 8);
    EXPECT_EQ(row["left_out"], 0);
    EXPECT_EQ(row["near"]["vertex_triangle"], 1);
    EXPECT_EQ(row["distance"], .3); // not the double nearest to the float
    EXPECT_EQ(row["least_distance"], .25);
    EXPECT_EQ(row["crossings"], 0);
    EXPECT_FALSE(row.contains("safe_step"));
    EXPECT_EQ(row["threads"], 2);
    EXPECT_GE(row["ms"]["near"], 0);
    std::istringstream lines(read("p.csv"));
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line, "found,kind,triangle_a,triangle_b,x,y,z,value");
    std::getline(lines, line);
    EXPECT_EQ(line, "near,vertex_triangle,2,0,0.25,0.125,0.25,0.25");
    int more = 0;
    while (std::getline(lines, line))
        EXPECT_EQ(line.find("near,edge_edge,"), 0u) << line, ++more;
    EXPECT_EQ(row["near"]["edge_edge"], more);

    EXPECT_EQ(told({"a.obj"})["least_distance"], nullptr);
    const Result table = run({"surface", "a.obj", "--distance", "0.3"});
    EXPECT_EQ(table.out.find("a.obj: 7 vertices, 3 triangles, 8 edges\nwithin 0.3: 1 of a vertex and a "
                             "triangle, "),
              0u)
        << table.out;
    EXPECT_NE(table.out.find("least distance 0.25\ncrossings: 0\n"), std::string::npos) << table.out;
    EXPECT_EQ(run({"surface", "a.obj", "--distance", "0.3", "--pairs", "-"}).out, read("p.csv"));
}

TEST_F(SurfaceCommand, TellsHowMuchOfAStepIsSafe)
{
    write("a.obj", strip_and_triangle(.25));
    write("b.obj", strip_and_triangle(-.25));
    const json row = told({"a.obj", "b.obj", "--pairs", "p.csv"});
    EXPECT_NEAR(row["safe_step"].get<double>(), .5, 1e-6);
    EXPECT_LE(row["safe_step"], .5); // never late
    EXPECT_GE(row["impacts"]["vertex_triangle"], 1);
    EXPECT_EQ(row["crossings"], 0);
    EXPECT_GT(row["crossings_after"], 0);
    EXPECT_NE(read("p.csv").find("impact,vertex_triangle,2,0,0.25,"), std::string::npos) << read("p.csv");
    EXPECT_NE(read("p.csv").find("crossings_after,edge_triangle,"), std::string::npos);
    const json back = told({"b.obj"});
    EXPECT_EQ(back["crossings"], row["crossings_after"]);
    const json near = told({"a.obj", "b.obj", "--distance", "0.125"});
    EXPECT_NEAR(near["safe_step"].get<double>(), .25, 1e-6);
    EXPECT_EQ(told({"a.obj", "a.obj"})["safe_step"], 1);
    EXPECT_NE(run({"surface", "a.obj", "b.obj"}).out.find(" come within it; 0.4999999"), std::string::npos);

    // A seam that opens: what was one vertex are two, and nothing touches that shares one.
    write("seam.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 4 6 5\n");
    write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv 1 1 0\nv 2 1 0\nf 1 2 3\nf 4 6 5\n");
    EXPECT_EQ(told({"seam.obj"})["vertices"], 4);
    EXPECT_EQ(told({"seam.obj", "open.obj"})["vertices"], 6);
    EXPECT_EQ(told({"seam.obj", "open.obj"})["safe_step"], 0);
}

TEST_F(SurfaceCommand, LeavesOutTrianglesThatAreNone)
{
    write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nf 1 2 4\nf 1 2 3\nf 1 4 1\n");
    const json row = told({"a.obj", "--distance", "1"});
    EXPECT_EQ(row["triangles"], 1);
    EXPECT_EQ(row["left_out"], 2);
    EXPECT_NE(run({"surface", "a.obj"}).out.find("left out: 2 triangles that are an edge or a point\n"),
              std::string::npos);
    // Pairs name triangles as the file numbers them.
    std::string text = strip_and_triangle(.25);
    text.insert(text.find("f 1 2 3"), "f 1 1 2\n");
    write("b.obj", text);
    EXPECT_EQ(told({"b.obj", "--distance", "0.3", "--pairs", "p.csv"})["left_out"], 1);
    EXPECT_NE(read("p.csv").find("near,vertex_triangle,3,1,0.25,0.125,0.25,0.25\n"), std::string::npos);
    write("none.obj", "v 0 0 0\nv 1 0 0\nv 0 0 0\nf 1 2 3\n");
    refused({"surface", "none.obj"}, "none.obj: each of its triangles is an edge or a point");
}

TEST_F(SurfaceCommand, RefusesWhatIsNoSuchMesh)
{
    write("a.obj", strip_and_triangle(.25));
    write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\np 1 2 3\n");
    write("boxes.csv", "0,0,1,1\n");
    write("nan.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 nan 0\nvertex 0 1 0\n"
                     "endloop\nendfacet\nendsolid s\n");
    write("far.obj", "v 0 0 0\nv 3e38 0 0\nv 0 1 0\nf 1 2 3\n");
    refused({"surface", "a.obj", "one.obj"},
            "one.obj: has 1 triangles, and a.obj has 3; give the same mesh at two times");
    refused({"surface", "points.obj"}, "points.obj: ");
    refused({"surface", "boxes.csv"}, "boxes.csv: is no mesh; give .obj, .stl, .ply, .glb, ...");
    refused({"surface", "nan.stl"}, "nan.stl: triangle 0 has a corner that isn't finite");
    refused({"surface", "far.obj"}, "far.obj: ");
    refused({"surface", "missing.obj"}, "missing.obj: ");
    refused({"surface", "a.obj", "--distance", "-1"}, "--distance");
    refused({"surface", "a.obj", "--distance", "nan"}, "a.obj: the distance is nan");
    refused({"surface", "a.obj", "--pairs", "p.npy"}, "p.npy: pairs are written as CSV");
    refused({"surface", "a.obj", "--pairs", "-", "--json", "-"}, "would both write to stdout");
    refused({"surface"}, "FILE");
    EXPECT_FALSE(exists("p.npy"));
}

} // namespace
} // namespace tool_test
