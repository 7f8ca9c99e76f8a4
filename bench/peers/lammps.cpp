// SPDX-License-Identifier: MIT
// LAMMPS: the list that it builds for a pair style, in a step in which no atom moves. 97 % of such a step is
// the list, the rest images of atoms near the border, which a list needs as well.
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <lammps/library.h>

#include "bench/neighbor_peers.hpp"

namespace jostle_bench {

namespace {

class Lammps : public NeighborPeer
{
  public:
    [[nodiscard]] const char* name() const noexcept override { return "lammps"; }
    [[nodiscard]] bool is_periodic() const noexcept override { return true; }
    void start(std::span<const jostle::Vec3f> points, float cutoff, double edge) override
    {
        std::vector<double> places;
        for (const jostle::Vec3f& point : points)
            for (const double x : point)
                places.push_back(x - edge * std::floor(x / edge)); // it takes atoms of the cell alone
        const std::vector<int> types(points.size(), 1);
        const std::string length = std::to_string(edge);

        run("clear");
        run("units metal");
        run("atom_style atomic");
        run("region cell block 0 " + length + " 0 " + length + " 0 " + length);
        run("create_box 1 cell");
        run("mass 1 12");
        const auto count = static_cast<int>(points.size());
        if (lammps_create_atoms(lammps_.get(), count, nullptr, types.data(), places.data(), nullptr, nullptr,
                                0) != count)
            throw std::runtime_error("LAMMPS doesn't take all atoms");
        run("pair_style zero " + std::to_string(cutoff) + " nocoeff"); // has a list, and computes nothing
        run("pair_coeff * *");
        run("neighbor 0 bin");
        run("neigh_modify every 1 delay 0 check no one 10000"); // a new list in each step
        run("run 0 post no");
    }
    void find() override { run("run 1 pre no post no"); }
    [[nodiscard]] std::uint64_t found() const override
    {
        const int list = lammps_find_pair_neighlist(lammps_.get(), "zero", 1, 0, 0);
        const int rows = lammps_neighlist_num_elements(lammps_.get(), list);
        std::uint64_t all = 0;
        for (int i = 0; i < rows; ++i) {
            int atom = 0, count = 0, *neighbors = nullptr;
            lammps_neighlist_element_neighbors(lammps_.get(), list, i, &atom, &count, &neighbors);
            all += static_cast<std::uint64_t>(count);
        }
        return all;
    }

  private:
    static void* open()
    {
        std::string arguments[] = {"lammps", "-log", "none", "-screen", "none", "-nocite"};
        std::vector<char*> pointers;
        for (std::string& each : arguments)
            pointers.push_back(each.data());
        void* lammps = lammps_open_no_mpi(static_cast<int>(pointers.size()), pointers.data(), nullptr);
        if (lammps == nullptr) throw std::runtime_error("LAMMPS doesn't start");
        return lammps;
    }
    void run(const std::string& command) { lammps_command(lammps_.get(), command.c_str()); }

    std::unique_ptr<void, void (*)(void*)> lammps_{open(), lammps_close};
};

} // namespace

std::unique_ptr<NeighborPeer> make_lammps()
{
    return std::make_unique<Lammps>();
}

} // namespace jostle_bench
