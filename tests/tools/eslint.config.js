import js from "@eslint/js";

export default [
  js.configs.recommended,
  {
    rules: {
      eqeqeq: ["error", "smart"],
      "no-shadow": "error",
      "no-undef": "off", // the type check knows what a browser has
      "no-var": "error",
      "prefer-const": "error",
    },
  },
];
