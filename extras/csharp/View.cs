// SPDX-License-Identifier: MIT
using System;

namespace Jostle
{
    /// <summary>What a call found, read in place in the library's memory: nothing is copied, and there is no
    /// garbage. Valid until its owner is called again; read later, it throws. A span that was taken out of it
    /// can't: keep such spans, and nothing else, within the frame.</summary>
    public readonly unsafe ref struct View<T> where T : struct
    {
        internal readonly Owner Owner;
        internal readonly int State;
        readonly Native.jostle_block* blocks; // null: the one below
        readonly Native.jostle_block one;
        /// <summary>How many pieces there are: see Block.</summary>
        public int BlockCount { get; }
        /// <summary>How many items there are.</summary>
        public long Count { get; }

        internal View(Owner owner, Native.jostle_blocks found)
        {
            Owner = owner;
            State = owner.State;
            blocks = found.blocks;
            one = new Native.jostle_block();
            BlockCount = checked((int)found.block_count);
            Count = (long)found.count;
        }

        internal View(Owner owner, void* items, ulong count)
        {
            Owner = owner;
            State = owner.State;
            blocks = null;
            one = new Native.jostle_block { items = items, count = count };
            BlockCount = count == 0 ? 0 : 1;
            Count = (long)count;
        }

        // Somebody's own items, while they are pinned.
        internal View(void* items, ulong count)
        {
            Owner = null;
            State = 0;
            blocks = null;
            one = new Native.jostle_block { items = items, count = count };
            BlockCount = count == 0 ? 0 : 1;
            Count = (long)count;
        }

        // What is given back to the library.
        internal Native.jostle_blocks Blocks(Native.jostle_block* room)
        {
            if (Owner != null) Owner.Expect(State);
            *room = one;
            return new Native.jostle_blocks { blocks = blocks == null ? room : blocks,
                block_count = (ulong)BlockCount, count = (ulong)Count,
                                              item_size = (ulong)SizeOf<T>.Bytes };
        }

        /// <summary>A piece of the result: the items come one piece after another, each in one row.</summary>
        public ReadOnlySpan<T> Block(int block)
        {
            if ((uint)block >= (uint)BlockCount) throw new ArgumentOutOfRangeException(nameof(block));
            Owner.Expect(State);
            Native.jostle_block found = blocks == null ? one : blocks[block];
            return new ReadOnlySpan<T>(found.items, checked((int)found.count));
        }

        public void CopyTo(Span<T> room)
        {
            for (int block = 0, at = 0; block < BlockCount; ++block)
            {
                ReadOnlySpan<T> items = Block(block);
                items.CopyTo(room.Slice(at));
                at += items.Length;
            }
        }

        public T[] ToArray()
        {
            T[] items = new T[Count];
            CopyTo(items);
            return items;
        }

        public Enumerator GetEnumerator() { return new Enumerator(this); }

        public ref struct Enumerator
        {
            readonly View<T> view;
            ReadOnlySpan<T> items;
            int block, at;

            internal Enumerator(View<T> view)
            {
                this.view = view;
                items = default(ReadOnlySpan<T>);
                block = 0;
                at = -1;
            }

            public bool MoveNext()
            {
                if (view.Owner != null) view.Owner.Expect(view.State);
                if (++at < items.Length) return true;
                while (block < view.BlockCount)
                {
                    items = view.Block(block++);
                    at = 0;
                    if (items.Length != 0) return true;
                }
                return false;
            }

            public ref readonly T Current { get { return ref items[at]; } }
        }
    }
}
