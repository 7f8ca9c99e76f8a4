// SPDX-License-Identifier: MIT

/** What was wrong with the data that a call was given: see jostle.d.ts. */
export class JostleError extends Error {
  constructor(message, status = "invalid_argument", index, value) {
    super(message);
    this.name = "JostleError";
    this.status = status;
    this.index = index;
    this.value = value;
  }
}

export function refuse(message, status, index, value) {
  throw new JostleError(message, status, index, value);
}
