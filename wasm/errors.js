// wasm/errors.js - built into the module (--pre-js). An exception thrown inside a binding would leave the wasm frames beneath
// it on the stack for good, so bindings answer null and leave a message; here, after they have returned, it is thrown.
Module["postRun"] = [].concat(Module["postRun"] || [], () => {
  const orThrow = (answer) => {
    if (answer === null) throw new Error(Module["takeError"]());
    return answer;
  };
  const parsed = (text) => {
    try {
      return JSON.parse(text);
    } catch {
      throw new Error("config: not JSON");
    }
  };
  // A constructor that returns an object makes `new` give that object.
  Module["Session"] = function Session(bytes, configJson) {
    return orThrow(Module["makeSession"](bytes, parsed(configJson)));
  };
  Module["Player"] = function Player(bytes) {
    return orThrow(Module["makePlayer"](bytes));
  };
  Module["runScene"] = (name, engine = "", cycles = 0, discs = 0) =>
    orThrow(Module["makeScene"](String(name), String(engine), Number(cycles), Number(discs)));
});
