// SPDX-License-Identifier: MIT
// A game loop: crates fall to the floor one after the other; a trigger tells who is in the doorway.
using System;
using Jostle;

static class GameLoop
{
    struct Crate
    {
        public ObjectId Id;
        public float X, Y, Falling, Sliding;
        public Box3 Box { get { return new Box3(new Vec3(X, Y, -0.5f), new Vec3(X + 1, Y + 1, 0.5f)); } }
    }

    static int Main()
    {
        using (World world = new World())
        {
            ObjectId floor = world.Add(new Box3(new Vec3(-50, -1, -50), new Vec3(50, 0, 50)),
                ObjectFilter.Static);
            // pairs are all it needs
            ObjectId door = world.Add(new Box3(new Vec3(8, 0, -1), new Vec3(10, 3, 1)), ObjectFilter.Static);
            Crate[] crates = new Crate[5];
            for (int k = 0; k < crates.Length; ++k)
            {
                crates[k] = new Crate { X = 1.5f * k, Y = 2 + k };
                crates[k].Id = world.Add(crates[k].Box);
                world.SetUserData(crates[k].Id, (ulong)k); // which one it is: pairs lead to it
            }

            int landed = 0, entered = 0, left = 0;
            for (int frame = 0; frame < 240; ++frame)
            {
                for (int k = 0; k < crates.Length; ++k)
                    if (crates[k].Falling != 0 || crates[k].Sliding != 0 || crates[k].Y > 1)
                    {
                        if (crates[k].Sliding == 0) crates[k].Falling += 0.01f;
                        crates[k].Y -= crates[k].Falling;
                        crates[k].X += crates[k].Sliding;
                        world.Move(crates[k].Id, crates[k].Box); // those at rest say nothing and cost nothing
                    }
                world.Update();
                foreach (ObjectPair pair in world.Began)
                {
                    if (pair.A == floor)
                    {
                        ulong k = world.UserData(pair.B);
                        Console.WriteLine("frame " + frame + ": crate " + k + " lands");
                        crates[k].Falling = 0;
                        crates[k].Sliding = 0.1f; // and slides towards the door
                        ++landed;
                    }
                    if (pair.A == door) ++entered;
                }
                foreach (EndedPair pair in world.Ended)
                    if (pair.A == door && pair.Reason == EndReason.MovedApart) ++left;
            }
            Console.WriteLine(landed + " landed, " + entered + " went through the door, " + left +
                " came out");

            Hit hit; // who stands in the way of a ray from the left?
            if (world.First(new Ray3(new Vec3(-20, 0.5f, 0), new Vec3(1, 0, 0)), out hit,
                new QueryFilter { Exclude = floor }))
                Console.WriteLine("a ray meets " + (hit.Object == door ? "the door" : "crate " +
                    world.UserData(hit.Object)));
            return landed == 5 && entered == 5 && left >= 4 ? 0 : 1;
        }
    }
}
