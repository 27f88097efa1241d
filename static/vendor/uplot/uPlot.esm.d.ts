// All that the type check is told of the library, which is not ours to check.
declare const uPlot: { new (...given: any[]): any; [name: string]: any };
export default uPlot;
