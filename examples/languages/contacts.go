// SPDX-License-Identifier: MIT

// Spheres that touch and how deep, from Go: boxes around them, pairs of boxes, contacts of pairs.
//
//	CGO_CFLAGS=-IINCLUDE CGO_LDFLAGS='-LFOLDER -ljostle' go run contacts.go
package main

/*
#include <jostle/jostle.h>
#include <stdlib.h>
#include <string.h>
*/
import "C"

import (
	"fmt"
	"log"
	"unsafe"
)

var jerr C.jostle_error

func check(status C.jostle_status) {
	if status != C.JOSTLE_OK {
		log.Fatal(C.GoString(&jerr.message[0]))
	}
}

// floats is memory of C's, which C may keep pointers to.
func floats(count int) (unsafe.Pointer, []float32) {
	memory := C.calloc(C.size_t(count), 4)
	return memory, unsafe.Slice((*float32)(memory), count)
}

func main() {
	const n = 1000
	var shapes *C.jostle_shapes
	var sphere *C.jostle_shape
	check(C.jostle_shapes_new(3, &shapes, &jerr))
	check(C.jostle_shape_sphere(3, 0.5, &sphere, &jerr))
	check(C.jostle_shapes_add(shapes, sphere, n, &jerr))

	// Poses: position, and a rotation as a quaternion. A row of spheres that overlap by a tenth.
	memory, poses := floats(7 * n)
	defer C.free(memory)
	for i := 0; i < n; i++ {
		poses[7*i], poses[7*i+6] = 0.9*float32(i), 1
	}
	objects := (*C.jostle_objects)(C.calloc(1, C.sizeof_jostle_objects))
	defer C.free(unsafe.Pointer(objects))
	objects.shapes = shapes
	objects.poses = C.jostle_values{data: memory, count: n, stride: 7 * 4}

	rows, _ := floats(6 * n)
	defer C.free(rows)
	check(C.jostle_bounds(C.JOSTLE_3F, objects, 0, nil, rows, &jerr))
	boxes := (*C.jostle_boxes)(C.calloc(1, C.sizeof_jostle_boxes))
	defer C.free(unsafe.Pointer(boxes))
	*boxes = C.jostle_boxes_strided(C.JOSTLE_3F, rows, unsafe.Add(rows, 12), n, 24)

	var finder *C.jostle_finder
	var narrow *C.jostle_contact_finder
	var pairs, contacts C.jostle_blocks
	check(C.jostle_finder_new(nil, &finder, &jerr))
	check(C.jostle_contact_finder_new(C.JOSTLE_3F, nil, &narrow, &jerr))
	check(C.jostle_finder_find(finder, C.JOSTLE_3F, boxes, nil, nil, C.JOSTLE_SORTED, &pairs, &jerr))
	check(C.jostle_contact_finder_find(narrow, objects, nil, &pairs, 0, &contacts, &jerr))

	first := *(*C.jostle_contact_3f)(contacts.blocks.items)
	fmt.Printf("%d pairs, %d contacts\n", pairs.count, contacts.count)
	fmt.Printf("%d and %d overlap by %.2f\n", first.pair.a, first.pair.b, float32(first.point[0].depth))

	check(C.jostle_free(unsafe.Pointer(narrow), &jerr))
	check(C.jostle_free(unsafe.Pointer(finder), &jerr))
	check(C.jostle_free(unsafe.Pointer(shapes), &jerr))
	check(C.jostle_free(unsafe.Pointer(sphere), &jerr))
}
