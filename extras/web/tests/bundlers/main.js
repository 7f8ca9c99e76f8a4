// What a stranger writes first; the page's title says what came of it.
import { load } from "jostle";

const jostle = await load({ threads: crossOriginIsolated ? 2 : 1 });
const pairs = jostle.findPairs(new Float32Array([0, 0, 2, 2, 1, 1, 3, 3, 5, 5, 6, 6]), { dim: 2 });
document.title = `pairs ${pairs}, threads ${jostle.threads}`;
