-- SPDX-License-Identifier: MIT
-- Boxes that stay, and queries about them, from LuaJIT.
--     luajit nearest.lua LIBJOSTLE FOLDER_OF_JOSTLE_JOSTLE_H
local ffi = require("ffi")
local library, include = arg[1] or "jostle", arg[2] or "/usr/include"

-- The header as it is, after the preprocessor.
local header = assert(io.popen("cc -E -P -I" .. include .. " " .. include .. "/jostle/jostle.h"))
ffi.cdef(header:read("*a"))
header:close()
local jostle = ffi.load(library)

-- Every call ends with an error; here it becomes Lua's.
local err = ffi.new("jostle_error")
local function call(name, ...)
    local arguments = { ... }
    arguments[select("#", ...) + 1] = err
    if jostle["jostle_" .. name](unpack(arguments, 1, select("#", ...) + 1)) ~= 0 then
        error(ffi.string(err.message), 2)
    end
end

-- A row of 100 squares in 2D, one apart.
local n = 100
local rows = ffi.new("double[?]", 4 * n)
for i = 0, n - 1 do
    rows[4 * i], rows[4 * i + 1], rows[4 * i + 2], rows[4 * i + 3] = 2 * i, 0, 2 * i + 1, 1
end
local boxes = ffi.new("jostle_boxes")
boxes.lo[0], boxes.lo[1], boxes.hi[0], boxes.hi[1] = rows, rows + 1, rows + 2, rows + 3
boxes.count, boxes.stride = n, 4 * 8

local out = ffi.new("jostle_index*[1]")
call("index_new", jostle.JOSTLE_2D, nil, out)
local index = out[0]
call("index_build", index, nil, boxes)

local results_out = ffi.new("jostle_results*[1]")
call("results_new", nil, results_out)
local results, lists = results_out[0], ffi.new("jostle_lists")

-- The three that are nearest to a point: its coordinates, how far.
local point = ffi.new("double[3]", 20.5, 3, math.huge)
local near = ffi.new("jostle_queries[1]", { { jostle.JOSTLE_NEAREST, 3, { point, 1, 3 * 8 } } })
call("query_all", index, near, nil, nil, -1ULL, results)
call("results_lists", results, lists)
for i = 0, tonumber(lists.count) - 1 do
    print(("near: %d at %.3f"):format(tonumber(lists.ids[i]), math.sqrt(lists.at[i])))
end

-- What a ray meets first: origin, direction, how far.
local numbers, hit = ffi.new("double[5]", -3, 0.5, 1, 0, math.huge), ffi.new("jostle_hit[1]")
local ray = ffi.new("jostle_queries[1]", { { jostle.JOSTLE_RAY, 0, { numbers, 1, 5 * 8 } } })
call("query_first", index, ray, nil, nil, hit, nil)
print(("ray: %d at %g"):format(tonumber(hit[0].id), hit[0].at))

-- A mistake is an error that names the object.
rows[4 * 7] = 0 / 0
print(select(2, pcall(call, "index_build", index, nil, boxes)):match("box 7") or "no error")
call("free", index)
call("free", results)
